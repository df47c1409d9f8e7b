#include "producers/preimage_producer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using preimage::Vector;

namespace {

/// A point this far beyond the bound of a wedge still counts as in it. What is said about it allows for that.
constexpr double beside_wedge = 0x1p-42;

/// The smallest wedge of a fan that has all points, but for `beside_wedge`.
template <typename Family>
std::optional<typename Family::Wedge> wedge_around(const Family& fan, std::uint32_t levels,
                                                   std::span<const Vector> points, const Vector& centre) {
  const auto axes = static_cast<std::size_t>(fan.axes());
  std::size_t axis = 0;
  for (std::size_t i = 1; i < axes; ++i)
    if (std::fabs(centre[i]) > std::fabs(centre[axis])) axis = i;
  typename Family::Wedge wedge;
  wedge.face = static_cast<std::uint32_t>(2 * axis + (centre[axis] < 0 ? 1 : 0));
  const double sign = wedge.sign();
  // On which sides of y_i = t |y_a| the points are: below, above.
  const auto sides = [&](std::size_t i, double t) {
    const double slack = beside_wedge * std::sqrt(1 + t * t);
    std::pair<bool, bool> side{true, true};
    for (const Vector& y : points) {
      const double value = y[i] - t * sign * y[axis];
      side.first = side.first && value <= slack;
      side.second = side.second && value >= -slack;
    }
    return side;
  };
  for (std::size_t j = 0; j + 1 < axes; ++j) {
    const auto i = static_cast<std::size_t>(Family::axis_at(wedge, static_cast<int>(j)));
    if (!sides(i, 1).first || !sides(i, -1).second) return std::nullopt;
  }
  while (wedge.level < levels) {
    typename Family::Wedge half = wedge;
    ++half.level;
    for (std::size_t j = 0; j + 1 < axes; ++j) {
      const double n = std::ldexp(1.0, static_cast<int>(wedge.level));
      const auto side = sides(static_cast<std::size_t>(Family::axis_at(wedge, static_cast<int>(j))),
                              (2 * static_cast<double>(wedge.at[j]) + 1 - n) / n);
      if (!side.first && !side.second) return wedge;
      half.at[j] = 2 * wedge.at[j] + (side.first ? 0 : 1);
    }
    wedge = half;
  }
  return wedge;
}

/// The wedge, or a wider one, whose arcs are about as long as the points are far apart across the tube. A
/// section along the axis is in wedges as narrow as one likes, and narrow ones have short arcs, each of which
/// cuts off next to nothing.
geometry::RoundFamily<3>::Wedge with_arcs_for(geometry::RoundFamily<3>::Wedge wedge, double minor,
                                              std::span<const Vector> points, const Vector& centre) {
  double square = 0;
  for (const Vector& y : points) {
    const double across = std::hypot(y[0], y[1]) - std::hypot(centre[0], centre[1]), up = y[2] - centre[2];
    square = std::max(square, across * across + up * up);
  }
  const double arcs = std::ceil(std::max(0.0, std::log2(minor / std::max(std::sqrt(square), 0x1p-40)))) + 1;
  const double lag =
      std::max(0.0, std::floor(-std::log2(minor) / 2));  // of arcs behind wedges, as TorusFamily has it
  const auto level = std::min(wedge.level, static_cast<std::uint32_t>(arcs + lag));
  wedge.at[0] >>= wedge.level - level;
  wedge.level = level;
  return wedge;
}

/// Whether the mean of a cell's vertices is in its interior, whatever rounding did. The facets of a cell of
/// one dimension are its vertices.
template <int D>
bool has_its_centre(const CellView<D>& cell) {
  const auto& point = cell.extent().centre;
  if constexpr (D == 1) {
    const auto vertices = cell.cell().vertices();
    return std::all_of(vertices.begin(), vertices.end(), [&](const auto& vertex) {
      return std::fabs(vertex.x[0] - point[0]) > 2 * vertex.error;
    });
  } else {
    for (std::size_t facet = 0; facet < cell.cell().facet_count(); ++facet) {
      const OrientedHyperplane plane = cell.cell().facet_hyperplane(facet);
      const auto h = cell.table().rounded(plane.id());
      if ((plane.flipped() ? -h.at(point) : h.at(point)) > -2 * h.error) return false;
    }
    return true;
  }
}

template <typename Family>
typename Family::Wedge pyramid_around(const Family& fan, const Vector& centre) {
  return *wedge_around(fan, 0, std::span<const Vector>(), centre);
}

}  // namespace

// --- the image of a cell ---

/// @param error of each coordinate of x. @param image_error becomes as large as that of each coordinate of
/// the image, if that is larger.
template <int D>
Vector PreimageProducer<D>::in_frame(const std::array<double, D>& x, double error,
                                     double& image_error) const {
  const auto p = preimage_.to_primitive.image(x);
  const double p_error = preimage_.to_primitive.error + preimage_.to_primitive.scale * error;
  Vector y{};
  for (std::size_t i = 0; i < preimage_.rows.size(); ++i) {
    const auto& row = preimage_.rows[i];
    double size = std::fabs(row[D]), of_p = 0;
    y[i] = row[D];
    for (std::size_t j = 0; j < D; ++j) {
      y[i] += row[j] * p[j];
      size += std::fabs(row[j] * p[j]);
      of_p += std::fabs(row[j]) * p_error;
    }
    image_error = std::max(image_error, 1.01 * (of_p + 0x1p-49 * size));
  }
  return y;
}

template <int D>
typename PreimageProducer<D>::Image PreimageProducer<D>::image_of(const CellView<D>& cell) const {
  Image image;
  image.lower.fill(std::numeric_limits<double>::infinity());
  image.upper.fill(-std::numeric_limits<double>::infinity());
  const auto vertices = cell.cell().vertices();
  for (const auto& vertex : vertices) {
    const Vector y = in_frame(vertex.x, vertex.error, image.error);
    for (std::size_t i = 0; i < y.size(); ++i) {
      image.lower[i] = std::min(image.lower[i], y[i]);
      image.upper[i] = std::max(image.upper[i], y[i]);
      image.centre[i] += y[i] / static_cast<double>(vertices.size());
      image.reach = std::max(image.reach, std::fabs(y[i]));
    }
    image.points.push_back(y);
  }
  return image;
}

template <int D>
template <int F>
std::vector<std::array<double, F>> PreimageProducer<D>::points_of(const Image& image) const {
  std::vector<std::array<double, F>> points(image.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) std::copy_n(image.points[i].begin(), F, points[i].begin());
  return points;
}

// --- asking ---

template <int D>
Label PreimageProducer<D>::ask(const Word* leaf, CellView<D>& cell, Words& out) const {
  if (cell.box_test_only()) {
    out.append({leaf, leaf[1]});
    return Label::fuzzy;
  }
  const Image image = image_of(cell);
  out.push(leaf[0] & ~Program::whole, 0, leaf[2]);
  return std::visit(
      [&]<typename Kind>(const Kind& solid) {
        if constexpr (requires { solid.tree; }) {
          return keep_patches(*solid.tree, leaf, image, cell, out);
        } else {
          Word level = 0;
          const Label answer = std::isfinite(image.error) ? label(solid, image, level) : Label::fuzzy;
          out.push(level);
          return answer;
        }
      },
      preimage_.planes->solid());
}

/// A convex solid: what has its vertices inside is inside, and so is what is beyond a tangent outside.
template <int D>
Label PreimageProducer<D>::label(const preimage::RoundSolid& solid, const Image& image, Word& level) const {
  const auto& family = solid.family;
  const auto axes = static_cast<std::size_t>(family.axes());
  const bool tapered = solid.axes() > axes;
  const double slack =
      image.error * static_cast<double>(axes + 2) * 1.01 + 0x1p-47 * static_cast<double>(axes) * image.reach;
  const auto length = [&](const Vector& y) {
    double square = 0;
    for (std::size_t i = 0; i < axes; ++i) square += y[i] * y[i];
    return std::sqrt(square);
  };
  const auto radius = [&](const Vector& y) {
    return tapered ? family.bottom() + (family.top() - family.bottom()) * y[axes] : 1;
  };
  const auto is_beyond = [&](const Vector& towards) {
    const double size = length(towards);
    return size > 0 && std::all_of(image.points.begin(), image.points.end(), [&](const Vector& y) {
             double along = 0;
             for (std::size_t i = 0; i < axes; ++i) along += y[i] * towards[i];
             return along / size > radius(y) + slack;
           });
  };
  if (std::all_of(image.points.begin(), image.points.end(),
                  [&](const Vector& y) { return length(y) + slack <= radius(y); }))
    return Label::in;
  if (is_beyond(image.centre)) return Label::out;
  const auto wedge = wedge_around(family, family.levels(), image.points, image.centre);
  if (!wedge) return Label::fuzzy;
  level = wedge->level + 1;
  return is_beyond(family.direction(*wedge)) ? Label::out : Label::fuzzy;
}

/// As TorusProducer does. What is beside the wedge by at most `beside_wedge` is farther from the axis than
/// `most` says by at most 2.5 times that.
template <int D>
Label PreimageProducer<D>::label(const preimage::TorusSolid& solid, const Image& image, Word& level) const {
  const auto wedge = wedge_around(solid.fan, solid.levels(), image.points, image.centre);
  if (!wedge) return Label::fuzzy;
  level = wedge->level + 1;
  const double slack = 4 * (image.error + beside_wedge) + 0x1p-46 * image.reach;
  const double minor = solid.family.minor();
  struct Place {
    double least, most, z;
  };
  const auto d = geometry::TorusFamily::direction(*wedge);
  const auto [least, most] = geometry::TorusFamily::span(*wedge);
  std::vector<Place> at;
  for (const Vector& y : image.points) {
    const double along = d[0] * y[0] + d[1] * y[1];
    at.push_back({along * least, along * most, y[2]});
  }
  const auto distance = [](double rho, double z) { return std::hypot(rho - 1, z); };
  if (std::all_of(at.begin(), at.end(), [&](const Place& p) {
        return distance(p.least, p.z) + slack <= minor && distance(p.most, p.z) + slack <= minor;
      }))
    return Label::in;
  const auto is_beyond = [&](const std::array<double, 2>& e) {
    return std::all_of(at.begin(), at.end(), [&](const Place& p) {
      return e[0] * ((e[0] >= 0 ? p.least : p.most) - 1) + e[1] * p.z > minor + slack;
    });
  };
  for (const Place& p : at) {
    const double rho = (p.least + p.most) / 2, length = distance(rho, p.z);
    if (is_beyond(solid.family.middle(wedge->level, solid.family.arc_towards(wedge->level, rho, p.z))))
      return Label::out;
    if (length > 0 && is_beyond({(rho - 1) / length, p.z / length})) return Label::out;
  }
  return Label::fuzzy;
}

/// As SplineProducer does.
template <int D>
template <int F>
Label PreimageProducer<D>::keep_patches(const PatchTree<F>& tree, const Word* leaf, const Image& image,
                                        const CellView<D>& cell, Words& out) const {
  using Node = typename PatchTree<F>::Node;
  const std::size_t begin = out.size();
  const auto points = points_of<F>(image);
  Box<F> box;
  double size = 0;
  for (std::size_t i = 0; i < F; ++i) {
    box.lower[i] = image.lower[i] - image.error;
    box.upper[i] = image.upper[i] + image.error;
    size = std::max(size, box.upper[i] - box.lower[i]);
  }
  const auto keep = [&](const auto& self, std::uint32_t patch, const Node& node,
                        std::uint32_t level) -> void {
    if (node.box().misses(box) || !node.may_be_between(points, image.error)) return;
    if (node.size() <= 2 * size || level == tree.levels()) return out.push(patch);
    const auto first = tree.first_half(patch);
    const Node* const below = tree.halves_of(node, level);
    for (std::uint32_t half = 0; half < tree.halves(); ++half)
      self(self, first + half, below[half], level + 1);
  };
  const bool whole = (leaf[0] & Program::whole) != 0;
  const std::size_t known = whole ? tree.roots() : leaf[1] - Program::header;
  for (std::size_t i = 0; i < known; ++i) {
    const std::uint32_t patch = whole ? static_cast<std::uint32_t>(i) : leaf[Program::header + i];
    keep(keep, patch, tree.node(patch), tree.level(patch));
  }
  return out.size() == begin ? label_off_patches(tree, cell) : Label::fuzzy;
}

/// Of a cell whose image meets no patch: where one of its points is, all are.
template <int D>
template <int F>
Label PreimageProducer<D>::label_off_patches(const PatchTree<F>& tree, const CellView<D>& cell) const {
  if (!tree.closed()) return Label::out;
  const auto& point = cell.extent().centre;
  if (!has_its_centre(cell)) return Label::fuzzy;
  double error = 0;
  const Vector y = in_frame(point, 0, error);
  std::array<double, F> middle;
  std::copy_n(y.begin(), F, middle.begin());
  const auto winding = tree.winding(middle, error);
  return !winding ? Label::fuzzy : *winding != 0 ? Label::in : Label::out;
}

template <int D>
std::size_t PreimageProducer<D>::undecided(const Word* leaf) const {
  if ((leaf[0] & Program::whole) != 0) return 2;
  const std::size_t words = leaf[1] - Program::header;
  return std::visit(
      [&](const auto& solid) -> std::size_t {
        if constexpr (requires { solid.tree; })
          return 1 + words + (words == 0 ? 0 : 2 * std::size_t{solid.tree->level(leaf[Program::header])});
        else
          return 2 + 2 * std::size_t{leaf[Program::header]};
      },
      preimage_.planes->solid());
}

// --- advice ---

template <int D>
Advice PreimageProducer<D>::advise(const Word* leaf, CellView<D>& cell) const {
  const Image image = image_of(cell);
  const auto advice = std::visit([&](const auto& solid) { return advise_in(solid, leaf, image, cell); },
                                 preimage_.planes->solid());
  return advice ? *advice : halve(cell);
}

template <int D>
std::optional<Advice> PreimageProducer<D>::advise_in(const preimage::RoundSolid& solid, const Word*,
                                                     const Image& image, CellView<D>& cell) const {
  const auto& family = solid.family;
  const auto found = wedge_around(family, family.levels(), image.points, image.centre);
  const auto wedge = found.value_or(pyramid_around(family, image.centre));
  std::vector<std::uint32_t> numbers{family.tangent(wedge), family.chord(wedge)};
  if (!found || wedge.level < family.levels())
    for (int j = 0; j + 1 < family.axes(); ++j) {
      if (found) {
        numbers.push_back(family.halving(wedge, j).number);
      } else {
        for (const int side : {1, -1}) numbers.push_back(family.bound(wedge, j, side).number);
      }
    }
  for (const std::uint32_t number : numbers)
    if (const auto plane = preimage_.plane(number); cell.crosses(plane.id())) return Advice{plane};
  return std::nullopt;
}

template <int D>
std::optional<Advice> PreimageProducer<D>::advise_in(const preimage::TorusSolid& solid, const Word*,
                                                     const Image& image, CellView<D>& cell) const {
  const auto found = wedge_around(solid.fan, solid.levels(), image.points, image.centre);
  std::vector<std::uint32_t> numbers;
  if (!found) {
    const auto wedge = pyramid_around(solid.fan, image.centre);
    for (const int side : {1, -1}) numbers.push_back(solid.fan.bound(wedge, 0, side).number);
  } else {
    if (found->level > 0) {  // what is farthest out first; then the middle of the cell
      const auto wedge = with_arcs_for(*found, solid.family.minor(), image.points, image.centre);
      Vector farthest = image.centre;
      const auto distance = [](const Vector& y) { return std::hypot(std::hypot(y[0], y[1]) - 1, y[2]); };
      for (const Vector& y : image.points)
        if (distance(y) > distance(farthest)) farthest = y;
      for (const Vector& y : {farthest, image.centre}) {
        const auto arc = solid.family.arc_towards(wedge.level, std::hypot(y[0], y[1]), y[2]);
        for (const std::uint32_t number : {solid.family.outer(wedge, arc), solid.family.inner(wedge, arc)})
          numbers.push_back(solid.fan.count() + number);
      }
    }
    if (found->level < solid.levels()) numbers.push_back(solid.fan.halving(*found, 0).number);
  }
  for (const std::uint32_t number : numbers)
    if (const auto plane = preimage_.plane(number); cell.crosses(plane.id())) return Advice{plane};
  return std::nullopt;
}

/// The hyperplane of a patch that cuts off most of the cell, if that is much.
template <int D>
template <int F>
std::optional<Advice> PreimageProducer<D>::advise_in(const preimage::PatchSolid<F>& solid, const Word* leaf,
                                                     const Image& image, CellView<D>& cell) const {
  const PatchTree<F>& tree = *solid.tree;
  const bool whole = (leaf[0] & Program::whole) != 0;
  const std::size_t count = whole ? tree.roots() : leaf[1] - Program::header;
  const auto points = points_of<F>(image);
  std::optional<Advice> best;
  double most = 0.2;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t patch = whole ? static_cast<std::uint32_t>(i) : leaf[Program::header + i];
    const auto& node = tree.node(patch);
    for (std::uint32_t index = 0; index < tree.hyperplanes(); ++index) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const auto& point : points) {
        const double value = node.at(index, point);
        low = std::min(low, value);
        high = std::max(high, value);
      }
      const double share = high / (high - low);
      const OrientedHyperplane plane = preimage_.plane(patch * tree.hyperplanes() + index);
      if (!(share > most) || !(low < 0) || !cell.crosses(plane.id())) continue;
      most = share;
      best = Advice{plane};
    }
  }
  return best;
}

/// Across the axes of the model, the one first along which the image of the cell is longest. Those along
/// which it does not move are left alone: the solid is a prism along them.
template <int D>
Advice PreimageProducer<D>::halve(CellView<D>& cell) const {
  const auto& extent = cell.extent();
  std::vector<std::pair<double, int>> axes;
  for (int axis = 0; axis < D; ++axis)
    if (const double length = extent.length(axis) * preimage_.weight[axis]; length > 0)
      axes.emplace_back(-length, axis);
  std::sort(axes.begin(), axes.end());
  for (const auto& [length, axis] : axes) {
    const HyperplaneId id = network_.axial_cut(axis, extent.middle[axis]);
    if (cell.crosses(id)) return {geometry::oriented(id)};
  }
  return {.plane = {}, .none = true};
}

#define BSP2_INSTANTIATE(D)           \
  template class PreimageProducer<D>; \
  static_assert(ProducerProcess<PreimageProducer<D>, D>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
