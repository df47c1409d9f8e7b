#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/predicates.hpp"

namespace bsp2::model {

using Triangle = std::array<std::uint32_t, 3>;

/// Cuts faces into triangles: a sweep over a convex face projected along its largest axis, ears of any other
/// one, then flips towards Delaunay's choice. So the answer for a face that is not quite planar does not
/// depend on where its cycle starts, and is that of OpenSCAD; but if the face is not convex and has more than
/// three corners on a circle, it may be another one.
///
/// Whatever the face looks like (non-convex, touching or even crossing itself), the directed edges of the
/// triangles add up to those of the cycle: a closed mesh stays closed. Every comparison of positions is
/// exact, except the choice between two valid diagonals.
class Triangulator {
 public:
  explicit Triangulator(const std::vector<Point3>& points) : points_(points) {}
  /// Appends the size - 2 triangles of one face, wound as its cycle.
  void triangulate(std::span<const std::uint32_t> cycle, std::vector<Triangle>& triangles);

 private:
  struct Corner {
    Point2 at;
    std::uint32_t vertex;
    std::uint32_t previous, next;
    bool reflex;  ///< not strictly convex: it may lie in somebody's ear
  };
  enum Rule { clean, touching, flat, any };  ///< how little is asked of an ear, the more the less

  void project(std::span<const std::uint32_t> cycle, int axis, const Point3& area);
  [[nodiscard]] bool is_convex() const;
  [[nodiscard]] bool is_arrowhead() const;
  void add_convex_quadrilateral(std::vector<Triangle>& triangles) const;
  void zip_chains(std::vector<Triangle>& triangles) const;
  void clip_ears(std::vector<Triangle>& triangles);
  void flip_edges(std::span<Triangle> triangles) const;
  [[nodiscard]] bool is_ear(std::uint32_t tip, Rule rule) const;
  [[nodiscard]] bool blocks(const Corner& corner, const Corner& a, const Corner& b, const Corner& c,
                            Rule rule) const;
  void update(std::uint32_t corner);
  void build_grid();
  [[nodiscard]] std::array<int, 2> cell_of(const Point2& at) const;

  const std::vector<Point3>& points_;
  std::vector<Corner> corners_;
  // Corners that were reflex at first, by the cells of a grid: only they can block an ear.
  Point2 grid_low_{}, grid_scale_{};
  int grid_size_ = 1;
  std::vector<std::uint32_t> cell_begin_, cell_corners_;
};

}  // namespace bsp2::model
