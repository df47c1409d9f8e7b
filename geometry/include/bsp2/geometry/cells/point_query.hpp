#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/bsp_tree.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::geometry {

/// The half-space offset + normal . x <= 0; the normal of unit length.
template <int D>
struct HalfSpace {
  std::array<double, D> normal;
  double offset;
};

/// The point of an intersection of half-spaces that is nearest to the origin, in doubles.
///
/// By the dual method of active sets, whose length grows from step to step: it ends as soon as it exceeds
/// `limit`, since the point is farther away then.
/// @return the point; one no nearer than `limit` if there is none within it.
/// Source: Goldfarb, Idnani, "A numerically stable dual method for solving strictly convex quadratic
/// programs" (1983).
template <int D>
std::array<double, D> nearest_to_origin(std::span<const HalfSpace<D>> half_spaces, double limit);

/// Where a point is, and how far from what is not there.
template <int D>
struct PointAnswer {
  Label label = Label::out;
  std::int32_t leaf = 0;  ///< of the tree; 0: empty space
  /// To the nearest point that has, or may have, another label: a ball of this radius is all IN or all OUT. 0
  /// for FUZZY; infinite if all else is alike. Rounded; where nothing is FUZZY, it is the distance from the
  /// boundary.
  double distance = 0;
  std::array<double, D> nearest{};  ///< such a point
};

/// Answers questions about points of space from a BSP tree alone, in its cells as well as in empty space.
///
/// The label is exact: it is decided by the hyperplanes of the table. For the distance, leaves are visited in
/// ascending order of a lower bound, the largest distance of a hyperplane on their path that parts them from
/// the point; so few are looked at. Outside of the root cell all is OUT. Thread rule: any number of threads
/// may ask.
template <int D>
class PointQuery {
 public:
  /// @param tree with ids; its leaves k >= 1 have labels[k - 1]. Tree and table must outlive this.
  PointQuery(const HyperplaneTable<D>& table, const BspTree& tree, std::vector<Label> labels);
  [[nodiscard]] PointAnswer<D> ask(const std::array<double, D>& point) const;

 private:
  const HyperplaneTable<D>& table_;
  const BspTree& tree_;
  std::vector<Label> labels_;
  std::array<double, D> lower_, upper_;  // of the root cell

  [[nodiscard]] Label label_of(std::int32_t leaf) const {
    return leaf == 0 ? Label::out : labels_[static_cast<std::size_t>(leaf) - 1];
  }
  void search(const std::array<double, D>& point, PointAnswer<D>& answer) const;
};

}  // namespace bsp2::geometry
