#include "render/space.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bsp2::supersteps {

using geometry::BspTree;
using geometry::CellBatch;

Box3 bounds_of(const SolidMesh& mesh) {
  Box3 box;
  for (const auto& batch : mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      for (std::size_t v = 0; is_drawn(*batch, cell) && v < batch->point_count(cell); ++v)
        box.add(point_of(*batch, cell, v));
  return box;
}

Space::Space(const RunResult& result, const Camera& camera, const Box3& bounds, double explode)
    : result_(result), camera_(camera), middle_(bounds.middle()), explode_(explode) {
  // Without a partition all is one region.
  const BspTree& partition = result.partition;
  const bool is_divided = !partition.nodes.empty();
  struct Place {
    std::int32_t region,
        tree;  // nodes or leaves of the partition, and of the tree that begins with the same nodes
    Box3 box;
    std::vector<Bound> bounds;
  };
  std::vector<Place> stack;
  stack.push_back({is_divided ? partition.root : ~1, result.tree.root, bounds, {}});
  while (!stack.empty()) {
    Place at = std::move(stack.back());
    stack.pop_back();
    if (at.region < 0) {
      enter(static_cast<std::size_t>(~at.region) - 1, at.tree, point_within(at.box, at.bounds));
      continue;
    }
    const BspTree::Node& node = partition.nodes[at.region];
    auto [negative, positive] = halves(node.hyperplane, at.box);
    const bool shared = at.tree >= 0;  // else: this rank has no cells here
    at.bounds.push_back({node.hyperplane, 1});
    stack.push_back({node.negative, shared ? result.tree.nodes[at.tree].negative : BspTree::empty_leaf,
                     negative, at.bounds});
    at.bounds.back().sign = -1;
    stack.push_back({node.positive, shared ? result.tree.nodes[at.tree].positive : BspTree::empty_leaf,
                     positive, std::move(at.bounds)});
  }
}

void Space::enter(std::size_t region, std::int32_t root, const Vector& point) {
  if (region >= roots_.size()) {
    roots_.resize(region + 1, BspTree::empty_leaf);
    shifts_.resize(region + 1);
  }
  roots_[region] = root;
  const Vector way = difference(point, middle_);
  for (int i = 0; i < 3; ++i) shifts_[region][i] = explode_ * way[i];
}

/// The middle of a region's box; where hyperplanes that are not parallel to axes leave that outside, a
/// point found from there by stepping across the one that it is farthest beyond, again and again (Agmon's
/// relaxation).
Vector Space::point_within(const Box3& box, const std::vector<Bound>& bounds) const {
  constexpr int most_steps = 200;
  constexpr double overshoot = 1.5;
  const auto d = static_cast<std::size_t>(result_.partition.dimension);
  Vector point = box.middle();
  for (int step = 0; step < most_steps; ++step) {
    double worst = 0;
    const Bound* crossed = nullptr;
    for (const Bound& bound : bounds) {
      const double* h = result_.partition.hyperplanes.data() + bound.hyperplane * (d + 1);
      double value = h[0];
      for (std::size_t axis = 0; axis < d; ++axis) value += h[axis + 1] * point[axis];
      if (bound.sign * value <= worst) continue;
      worst = bound.sign * value;
      crossed = &bound;
    }
    if (crossed == nullptr) break;
    const double* h = result_.partition.hyperplanes.data() + crossed->hyperplane * (d + 1);
    for (std::size_t axis = 0; axis < d; ++axis)
      point[axis] = std::clamp(point[axis] - overshoot * worst * crossed->sign * h[axis + 1], box.low[axis],
                               std::max(box.low[axis], box.high[axis]));
  }
  return point;
}

/// A box on both sides of a hyperplane of the partition; one that is not parallel to an axis leaves it as
/// it is.
std::array<Box3, 2> Space::halves(std::uint32_t hyperplane, const Box3& box) const {
  std::array<Box3, 2> result{box, box};
  const auto d = static_cast<std::size_t>(result_.partition.dimension);
  const double* h = result_.partition.hyperplanes.data() + hyperplane * (d + 1);
  for (std::size_t axis = 0; axis < d; ++axis) {
    if (std::fabs(h[axis + 1]) < 1 - 1e-9) continue;
    const double x = std::clamp(-h[0] / h[axis + 1], box.low[axis], std::max(box.low[axis], box.high[axis]));
    const bool ascends = h[axis + 1] > 0;
    result[ascends ? 0 : 1].high[axis] = x;
    result[ascends ? 1 : 0].low[axis] = x;
  }
  return result;
}

}  // namespace bsp2::supersteps
