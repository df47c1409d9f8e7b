#include "producers/spline_producer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

namespace {

/// Patches are halved until they are at most so many times larger than the cell.
constexpr double patch_by_cell = 2;
/// A hyperplane that cuts off less of the cell's width than this can wait.
constexpr double least_cut = 0.2;
/// Where the patches of a cell leave more than this share of its length empty at an end, that end is cut off.
constexpr double most_empty = 1.0 / 16;

/// The position between a and b, a < b, after which the most binary digits are 0.
std::uint32_t roundest(std::uint32_t a, std::uint32_t b) { return b & ~(std::bit_floor(a ^ b) - 1); }

/// An axis-parallel hyperplane across the middle half of the cell: the same one in neighbouring cells of
/// about the same size.
template <int D>
std::optional<HyperplaneId> halving(CellView<D>& cell) {
  const auto& table = cell.table();
  for (const int axis : cell.extent().axes_by_length()) {
    const double margin = cell.extent().length(axis) / 4;
    const auto low = table.axis_position(axis, cell.extent().lower[axis] + margin),
               high = table.axis_position(axis, cell.extent().upper[axis] - margin);
    const HyperplaneId id = table.axis_hyperplane(
        axis, low < high ? roundest(low, high) : table.axis_position(axis, cell.extent().middle[axis]));
    if (cell.crosses(id)) return id;
  }
  return std::nullopt;
}

}  // namespace

/// The box in the frame of the patches, enlarged by what rounding may do.
template <int D>
Box<D> SplineProducer<D>::in_frame(const Box<D>& box) const {
  const auto& [scale, origin] = tree_.placement();
  Box<D> image = box;
  for (int i = 0; i < D; ++i) {
    const double margin =
        0x1p-50 * (std::fabs(box.lower[i]) + std::fabs(box.upper[i]) + std::fabs(origin[i]));
    image.lower[i] = (box.lower[i] - origin[i] - margin) / scale;
    image.upper[i] = (box.upper[i] - origin[i] + margin) / scale;
  }
  return image;
}

template <int D>
typename SplineProducer<D>::Image SplineProducer<D>::image_of(const CellView<D>& cell) const {
  Image image{.box = in_frame(cell.extent())};
  for (int i = 0; i < D; ++i) image.size = std::max(image.size, image.box.upper[i] - image.box.lower[i]);
  if (cell.box_test_only()) return image;
  const auto& [scale, origin] = tree_.placement();
  double error = 0, reach = 0;
  for (const auto& vertex : cell.cell().vertices()) {
    error = std::max(error, vertex.error);
    auto& point = image.points.emplace_back();
    for (std::size_t i = 0; i < D; ++i) {
      point[i] = (vertex.x[i] - origin[i]) / scale;
      reach = std::max({reach, std::fabs(vertex.x[i]), std::fabs(origin[i])});
    }
  }
  image.error = (error + 0x1p-50 * reach) / scale;
  return image;
}

/// False only where the patch certainly has no point in the cell. What doubles leave open, exact predicates
/// decide.
template <int D>
bool SplineProducer<D>::may_meet(Number patch, const Node& node, const Image& image,
                                 CellView<D>& cell) const {
  if (node.box().misses(image.box)) return false;
  if (cell.box_test_only()) return true;
  for (std::uint32_t i = 0; i < tree_.hyperplanes(); ++i) {
    const auto sides = node.sides(i, image.points, image.error);
    if (sides.all_positive ||
        (!sides.some_negative && cell.position(spline_.plane(patch, i)) == Position::positive))
      return false;
  }
  return true;
}

template <int D>
void SplineProducer<D>::keep(Number patch, const Node& node, std::uint32_t level, const Image& image,
                             CellView<D>& cell, Words& out) const {
  if (!may_meet(patch, node, image, cell)) return;
  if (node.size() <= patch_by_cell * image.size || level == tree_.levels()) {
    out.push(patch);
    return;
  }
  const Number first = tree_.first_half(patch);
  const Node* const below = tree_.halves_of(node, level);
  for (Number half = 0; half < tree_.halves(); ++half)
    keep(first + half, below[half], level + 1, image, cell, out);
}

template <int D>
Label SplineProducer<D>::ask(const Word* leaf, CellView<D>& cell, Words& out) const {
  const bool whole = (leaf[0] & Program::whole) != 0;
  if (cell.box_test_only() && whole && cell.extent().contains(producer_)) {
    out.append({leaf, Program::header});
    return Label::fuzzy;
  }
  const Image image = image_of(cell);
  out.push(leaf[0] & ~Program::whole, 0, leaf[2]);
  const std::size_t begin = out.size();
  const auto keep_some = [&](Number patch) {
    keep(patch, tree_.node(patch), tree_.level(patch), image, cell, out);
  };
  if (whole) {
    for (Number root = 0; root < tree_.roots(); ++root) keep_some(root);
  } else {
    for (const Word* at = leaf + Program::header; at != leaf + leaf[1]; ++at) keep_some(*at);
  }
  return out.size() == begin ? label_off_patches(cell) : Label::fuzzy;
}

/// Of a cell that meets no patch: where one of its points is, all are. FUZZY where no point of it can be
/// named in doubles.
template <int D>
Label SplineProducer<D>::label_off_patches(const CellView<D>& cell) const {
  if (!tree_.closed()) return Label::out;
  const auto& point = cell.extent().centre;
  for (std::size_t facet = 0; facet < cell.cell().facet_count(); ++facet) {
    const OrientedHyperplane plane = cell.cell().facet_hyperplane(facet);
    const auto h = cell.table().rounded(plane.id());
    if ((plane.flipped() ? -h.at(point) : h.at(point)) > -2 * h.error) return Label::fuzzy;
  }
  const Box<D> image = in_frame({point, point});
  Point middle;
  double error = 0;
  for (std::size_t i = 0; i < D; ++i) {
    middle[i] = (image.lower[i] + image.upper[i]) / 2;
    error = std::max(error, image.upper[i] - image.lower[i]);
  }
  const auto winding = tree_.winding(middle, error);
  return !winding ? Label::fuzzy : *winding != 0 ? Label::in : Label::out;
}

/// The box, in the model, of the parts in the cell's box that the boxes of the patches have.
template <int D>
Box<D> SplineProducer<D>::bounds(const Word* leaf, const CellView<D>& cell) const {
  const Box<D> image = in_frame(cell.extent());
  Box<D> box = Box<D>::empty();
  const auto add = [&](Number patch) {
    Box<D> part = tree_.node(patch).box();
    part.intersect(image);
    box.unite(part);
  };
  if ((leaf[0] & Program::whole) != 0) {
    for (Number root = 0; root < tree_.roots(); ++root) add(root);
  } else {
    for (const Word* at = leaf + Program::header; at != leaf + leaf[1]; ++at) add(*at);
  }
  const auto& [scale, origin] = tree_.placement();
  for (std::size_t i = 0; i < D; ++i) {
    box.lower[i] = scale * box.lower[i] + origin[i];
    box.upper[i] = scale * box.upper[i] + origin[i];
  }
  return box;
}

template <int D>
std::optional<HyperplaneId> SplineProducer<D>::end(const Word* leaf, CellView<D>& cell) const {
  const auto& table = cell.table();
  const Box<D> patches = bounds(leaf, cell);
  for (const int axis : cell.extent().axes_by_length()) {
    const double lower = cell.extent().lower[axis], upper = cell.extent().upper[axis],
                 least = most_empty * (upper - lower);
    for (const double from : {patches.lower[axis] - least, patches.upper[axis]}) {
      const auto first = table.axis_position(axis, from), last = table.axis_position(axis, from + least);
      if (from < lower || from + least > upper || first >= last) continue;
      const HyperplaneId id = table.axis_hyperplane(axis, roundest(first, last));
      if (cell.crosses(id)) return id;
    }
  }
  return std::nullopt;
}

template <int D>
std::size_t SplineProducer<D>::undecided(const Word* leaf) const {
  if ((leaf[0] & Program::whole) != 0) return 1 + tree_.roots();
  const std::size_t count = leaf[1] - Program::header;
  return 1 + count + (count == 0 ? 0 : 2 * std::size_t{tree_.level(leaf[Program::header])});
}

template <int D>
Advice SplineProducer<D>::advise(const Word* leaf, CellView<D>& cell) const {
  const bool whole = (leaf[0] & Program::whole) != 0;
  const std::size_t count = whole ? tree_.roots() : leaf[1] - Program::header;
  if (const auto id = end(leaf, cell)) return {geometry::oriented(*id)};
  const auto patch = [&](std::size_t i) {
    return whole ? static_cast<Number>(i) : leaf[Program::header + i];
  };
  Advice best{.plane = {}, .beyond_is_out = count == 1 && !tree_.closed()};
  double most = 0;
  const Image image = image_of(cell);
  for (std::size_t i = 0; i < count; ++i) {
    const Node& node = tree_.node(patch(i));
    for (std::uint32_t index = 0; index < tree_.hyperplanes(); ++index) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const Point& point : image.points) {
        const double value = node.at(index, point);
        low = std::min(low, value);
        high = std::max(high, value);
      }
      const double share = high / (high - low);
      const OrientedHyperplane plane = spline_.plane(patch(i), index);
      if (!(share > most) || !(low < 0) || !cell.crosses(plane.id())) continue;
      most = share;
      best.plane = plane;
    }
  }
  if (most >= least_cut) return best;
  if (const auto id = halving(cell)) return {geometry::oriented(*id)};
  best.none = most == 0;
  return best;
}

#define BSP2_INSTANTIATE(D)         \
  template class SplineProducer<D>; \
  static_assert(ProducerProcess<SplineProducer<D>, D>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
