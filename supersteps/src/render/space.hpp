#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/supersteps/state/run_result.hpp"
#include "render/camera.hpp"
#include "render/inner_sides.hpp"

namespace bsp2::supersteps {

/// The point of a cell in model space; of a plane cell at z = 0.
inline Vector point_of(const geometry::CellBatch& batch, std::size_t cell, std::size_t vertex) {
  const auto d = static_cast<std::size_t>(batch.dimension);
  const double* const p = batch.cell_points(cell).data() + vertex * d;
  return {p[0], p[1], d == 3 ? p[2] : 0};  // solids of two dimensions and three are drawn
}

inline bool is_drawn(const geometry::CellBatch& batch, std::size_t cell) {
  return batch.label[cell] != geometry::Label::out;
}

/// Of all cells that are drawn.
Box3 bounds_of(const SolidMesh& mesh);

/// The space of the picture: its regions, how far each is moved, and in which order they hide each other.
///
/// A region moves by `explode` times the way from the middle to a point within it, the middle of its box if
/// that is. So it stays within what it would be if all space were scaled about the middle: the regions are
/// still parted by a BSP tree, the same one, scaled; it is walked with the eye scaled back instead.
class Space {
 public:
  Space(const RunResult& result, const Camera& camera, const Box3& bounds, double explode);

  [[nodiscard]] const Vector& shift(std::size_t region) const { return shifts_[region]; }
  [[nodiscard]] RegionsInSpace regions() const { return {shifts_, roots_, explode_ > 0}; }

  /// Calls visit(region) for all regions, from the farthest to the nearest.
  template <typename Visit>
  void visit_regions(Visit visit) const {
    if (result_.partition.nodes.empty()) return visit(0);
    Vector eye{};
    if (camera_.is_perspective())
      for (int i = 0; i < 3; ++i) eye[i] = middle_[i] + (camera_.eye()[i] - middle_[i]) / (1 + explode_);
    walk(result_.partition, result_.partition.root, eye,
         [&](std::int32_t leaf) { visit(static_cast<std::size_t>(leaf) - 1); });
  }

  /// Calls visit(number) for the cells of a region that this rank has, from the farthest to the nearest.
  template <typename Visit>
  void visit_cells(std::size_t region, Visit visit) const {
    const Vector eye = camera_.is_perspective() ? difference(camera_.eye(), shifts_[region]) : Vector{};
    walk(result_.tree, roots_[region], eye,
         [&](std::int32_t leaf) { visit(static_cast<std::size_t>(leaf) - 1); });
  }

 private:
  const RunResult& result_;
  const Camera& camera_;
  Vector middle_;
  double explode_;
  std::vector<Vector> shifts_;
  std::vector<std::int32_t> roots_;  // in the tree

  /// A half-space of the partition: where sign times the hyperplane is negative.
  struct Bound {
    std::uint32_t hyperplane;
    double sign;
  };

  void enter(std::size_t region, std::int32_t root, const Vector& point);
  [[nodiscard]] Vector point_within(const Box3& box, const std::vector<Bound>& bounds) const;
  [[nodiscard]] std::array<Box3, 2> halves(std::uint32_t hyperplane, const Box3& box) const;

  /// In the plane nothing hides anything: any order will do, but it must not depend on who draws.
  template <typename Visit>
  void walk(const geometry::BspTree& tree, std::int32_t from, const Vector& eye, Visit visit) const {
    const bool parallel = !camera_.is_perspective();
    const Vector seen_from = parallel ? camera_.direction() : eye;
    tree.visit_back_to_front(from, {seen_from.data(), static_cast<std::size_t>(tree.dimension)}, parallel,
                             visit);
  }
};

}  // namespace bsp2::supersteps
