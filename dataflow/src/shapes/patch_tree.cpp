#include "bsp2/dataflow/shapes/patch_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/vectors.hpp"
#include "shapes/facet_crossing.hpp"

namespace bsp2::dataflow {
namespace {

constexpr double normal_unit = 0x1p18, offset_unit = 0x1p40;
constexpr std::uint32_t most_levels = 20;

using geometry::dot;

/// What is left of `v` across the unit vectors; of unit length, or 0 if next to nothing is left.
template <int D>
std::array<double, D> residual(std::array<double, D> v, const std::vector<std::array<double, D>>& basis) {
  const double whole = std::sqrt(dot(v, v));
  for (int pass = 0; pass < 2; ++pass)
    for (const auto& b : basis) {
      const double along = dot(v, b);
      for (std::size_t i = 0; i < D; ++i) v[i] -= along * b[i];
    }
  const double length = std::sqrt(dot(v, v));
  for (double& x : v) x = length > 1e-6 * whole ? x / length : 0;
  return v;
}

/// D - k unit vectors across the tangents. Any will do: they are only made use of where they are good.
template <int D>
std::vector<std::array<double, D>> normals_across(const std::vector<std::array<double, D>>& tangents) {
  std::vector<std::array<double, D>> basis, normals;
  for (const auto& tangent : tangents) {
    const auto unit = residual<D>(tangent, basis);
    if (dot(unit, unit) > 0.5) basis.push_back(unit);
  }
  while (normals.size() < D - tangents.size()) {
    std::array<double, D> best{};
    double most = -1;
    for (std::size_t axis = 0; axis < D; ++axis) {
      std::array<double, D> v{};
      v[axis] = 1;
      double rest = 1;
      for (const auto& b : basis) rest -= b[axis] * b[axis];
      if (rest > most + 1e-9) {
        most = rest;
        best = residual<D>(v, basis);
      }
    }
    normals.push_back(best);
    basis.push_back(best);
  }
  return normals;
}

}  // namespace

template <int D>
PatchTree<D>::PatchTree(std::vector<Patch<D>> roots, const Placement& placement, double error,
                        double weight_ratio, bool closed, std::uint64_t limit)
    : placement_(placement),
      error_(error),
      closed_(closed),
      parameters_(roots.front().parameters),
      roots_(static_cast<Number>(roots.size())) {
  if (parameters_ >= D) throw std::logic_error("a patch has fewer parameters than the space has dimensions");
  first_of_level_ = {0, roots_};
  std::uint64_t size = roots.size(), of_level = roots.size();
  while (levels_ < most_levels) {
    of_level <<= parameters_;
    size += of_level;
    if (size * hyperplanes() > std::min<std::uint64_t>(limit, 1U << 30)) break;
    first_of_level_.push_back(static_cast<Number>(size));
    ++levels_;
  }
  for (const Patch<D>& root : roots)
    halving_error_ = std::max(halving_error_, root.halving_error(weight_ratio));
  nodes_ = new Node[roots.size()];  // as the halves of nodes
  for (std::size_t i = 0; i < roots.size(); ++i) {
    nodes_[i].patch_ = std::move(roots[i]);
    finish(nodes_[i], 0);
  }
}

template <int D>
PatchTree<D>::~PatchTree() {
  release(nodes_, roots_, halves());
}

template <int D>
void PatchTree<D>::release(Node* nodes, std::size_t count, std::size_t halves) {
  for (std::size_t i = 0; i < count; ++i)
    if (Node* below = nodes[i].halves_.load()) release(below, halves, halves);
  delete[] nodes;
}

/// The box and the hyperplanes of a patch whose control points are known.
template <int D>
void PatchTree<D>::finish(Node& node, std::uint32_t level) const {
  const double error = error_at(level);
  std::vector<Point> points;
  node.box_ = Box<D>::empty();
  for (std::size_t index = 0; index < node.patch_.size(); ++index) {
    const Point point = node.patch_.point(index);
    node.box_.unite({point, point});
    points.push_back(point);
  }
  for (std::size_t i = 0; i < D; ++i) {
    node.box_.lower[i] -= error;
    node.box_.upper[i] += error;
    node.size_ = std::max(node.size_, node.box_.upper[i] - node.box_.lower[i]);
  }
  add_hyperplanes(node, points, error);
}

/// Normals are rounded to integers; offsets, to the outside by more than all rounding, to multiples of 2^-40
/// of a normal's unit.
template <int D>
void PatchTree<D>::add_hyperplanes(Node& node, const std::vector<Point>& points, double error) const {
  for (Point normal : normals_across<D>(node.patch_.tangents())) {
    double size = 0;
    for (double& x : normal) {
      x = std::nearbyint(x * normal_unit);
      size += std::fabs(x);
    }
    for (const double sign : {1.0, -1.0}) {
      double most = -std::numeric_limits<double>::infinity();
      for (const Point& point : points) most = std::max(most, sign * dot(normal, point));
      auto& hyperplane = node.hyperplanes_.emplace_back();
      for (std::size_t i = 0; i < D; ++i) hyperplane[i] = std::llround(sign * normal[i] * offset_unit);
      hyperplane[D] = -std::llround(std::ceil((most + size * (error + 0x1p-47)) * offset_unit));
    }
  }
}

template <int D>
typename PatchTree<D>::Node::Sides PatchTree<D>::Node::sides(std::size_t hyperplane,
                                                             std::span<const Point> points,
                                                             double error) const {
  std::array<double, D + 1> h;
  double size = 0;
  for (std::size_t i = 0; i <= D; ++i) h[i] = static_cast<double>(hyperplanes_[hyperplane][i]);
  for (std::size_t i = 0; i < D; ++i) size += std::fabs(h[i]);
  Sides sides{true, false};
  for (const Point& point : points) {
    double value = h[D], reach = std::fabs(h[D]);
    for (std::size_t i = 0; i < D; ++i) {
      const double term = h[i] * point[i];
      value += term;
      reach += std::fabs(term);
    }
    const double bound = size * error + reach * 0x1p-49;
    sides.all_positive = sides.all_positive && value > bound;
    sides.some_negative = sides.some_negative || value < -bound;
  }
  return sides;
}

template <int D>
double PatchTree<D>::Node::at(std::size_t hyperplane, const Point& point) const {
  double value = static_cast<double>(hyperplanes_[hyperplane][D]), square = 0;
  for (std::size_t i = 0; i < D; ++i) {
    const auto entry = static_cast<double>(hyperplanes_[hyperplane][i]);
    value += entry * point[i];
    square += entry * entry;
  }
  return value / std::sqrt(square);
}

template <int D>
bool PatchTree<D>::Node::may_be_between(std::span<const Point> points, double error) const {
  for (std::size_t i = 0; i < hyperplanes_.size(); ++i)
    if (sides(i, points, error).all_positive) return false;
  return true;
}

// --- numbers ---

template <int D>
std::uint32_t PatchTree<D>::level(Number number) const {
  std::uint32_t level = 0;
  while (number >= first_of_level_[level + 1]) ++level;
  return level;
}

template <int D>
typename PatchTree<D>::Number PatchTree<D>::first_half(Number number) const {
  const std::uint32_t at = level(number);
  return first_of_level_[at + 1] + ((number - first_of_level_[at]) << parameters_);
}

template <int D>
const typename PatchTree<D>::Node& PatchTree<D>::node(Number number) const {
  const std::uint32_t last = level(number), place = number - first_of_level_[last];
  const Node* node = nodes_ + (place >> (static_cast<std::uint32_t>(parameters_) * last));
  for (std::uint32_t at = 0; at < last; ++at) {
    const std::uint32_t half =
        place >> (static_cast<std::uint32_t>(parameters_) * (last - at - 1)) & (halves() - 1);
    node = halves_of(*node, at) + half;
  }
  return *node;
}

/// Two threads may make the same halves at once: they are alike, and one of them is thrown away.
template <int D>
const typename PatchTree<D>::Node* PatchTree<D>::halves_of(const Node& node, std::uint32_t level) const {
  if (const Node* known = node.halves_.load(std::memory_order_acquire)) return known;
  auto patches = node.patch_.halves();
  Node* const made = new Node[patches.size()];
  for (std::size_t i = 0; i < patches.size(); ++i) {
    made[i].patch_ = std::move(patches[i]);
    finish(made[i], level + 1);
  }
  Node* before = nullptr;
  if (node.halves_.compare_exchange_strong(before, made, std::memory_order_acq_rel)) return made;
  delete[] made;
  return before;
}

// --- the winding number ---

template <int D>
struct PatchTree<D>::Segment {
  std::array<Point, 2> ends;
  double error;         // of the coordinates of the first
  std::uint32_t level;  // at which patches are replaced by facets

  /// False where it certainly misses the box.
  [[nodiscard]] bool may_meet(const Box<D>& box) const {
    double first = 0, last = 1;
    for (std::size_t i = 0; i < D; ++i) {
      const double along = ends[1][i] - ends[0][i], low = box.lower[i] - error - 0x1p-40,
                   high = box.upper[i] + error + 0x1p-40;
      if (along == 0) {
        if (ends[0][i] < low || ends[0][i] > high) return false;
        continue;
      }
      const double a = (low - ends[0][i]) / along, b = (high - ends[0][i]) / along;
      first = std::max(first, std::min(a, b));
      last = std::min(last, std::max(a, b));
    }
    return first <= last;
  }
};

/// The level at which no patch's convex hull holds the point.
template <int D>
std::optional<std::uint32_t> PatchTree<D>::level_around(const Node& node, std::uint32_t level,
                                                        const Point& point, double error) const {
  for (std::size_t i = 0; i < D; ++i)
    if (point[i] < node.box().lower[i] - error || point[i] > node.box().upper[i] + error) return level;
  if (!node.may_be_between({&point, 1}, error)) return level;
  if (level == levels_) return std::nullopt;
  std::uint32_t deepest = level;
  const Node* const below = halves_of(node, level);
  for (std::uint32_t half = 0; half < halves(); ++half) {
    const auto at = level_around(below[half], level + 1, point, error);
    if (!at) return std::nullopt;
    deepest = std::max(deepest, *at);
  }
  return deepest;
}

/// A patch is replaced by facets through its corners, which lie in its convex hull, and so does the patch on
/// its way there.
/// @return false where rounding leaves a crossing open.
template <int D>
bool PatchTree<D>::count_crossings(const Node& node, std::uint32_t level, const Segment& segment,
                                   int& winding) const {
  if (!segment.may_meet(node.box()) || !node.may_be_between(segment.ends, segment.error)) return true;
  if (level < segment.level) {
    const Node* const below = halves_of(node, level);
    for (std::uint32_t half = 0; half < halves(); ++half)
      if (!count_crossings(below[half], level + 1, segment, winding)) return false;
    return true;
  }
  const auto at = node.patch_.corners();
  const double error = 2 * (segment.error + error_at(level) + 0x1p-50);
  std::optional<int> change;
  if constexpr (D == 2) {
    change = crossing(segment.ends[0], segment.ends[1], at[0], at[1], error);
  } else if constexpr (D == 3) {
    if (at.size() == 3) {
      change = crossing(segment.ends[0], segment.ends[1], at[0], at[1], at[2], error);
    } else {
      change = crossing(segment.ends[0], segment.ends[1], at[0], at[1], at[3], error);
      const auto other = crossing(segment.ends[0], segment.ends[1], at[0], at[3], at[2], error);
      change = change && other ? std::optional(*change + *other) : std::nullopt;
    }
  }
  if (change) winding += *change;
  return change.has_value();
}

template <int D>
std::optional<int> PatchTree<D>::winding(const Point& point, double error) const {
  for (const double x : point)
    if (std::fabs(x) > 1.25) return 0;
  std::uint32_t level = 0;
  for (Number root = 0; root < roots_; ++root) {
    const auto needed = level_around(nodes_[root], 0, point, error);
    if (!needed) return std::nullopt;
    level = std::max(level, *needed);
  }
  std::minstd_rand random(12345);  // the same segments in every run
  std::size_t nearest = 0;         // the axis along which it is not far to the outside
  for (std::size_t i = 1; i < D; ++i)
    if (std::fabs(point[i]) > std::fabs(point[nearest])) nearest = i;
  for (int attempt = 0; attempt < 12; ++attempt) {
    Segment segment{{point, point}, error, level};
    for (double& x : segment.ends[1])
      x += (static_cast<double>(random() % 2001) - 1000) * 0.7e-4 * (1 + attempt);
    segment.ends[1][nearest] = std::copysign(1.5, point[nearest]);
    int winding = 0;
    bool certain = true;
    for (Number root = 0; root < roots_ && certain; ++root)
      certain = count_crossings(nodes_[root], 0, segment, winding);
    if (certain) return -winding;  // it is 0 at the other end
  }
  return std::nullopt;
}

#define BSP2_INSTANTIATE(D) template class PatchTree<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
