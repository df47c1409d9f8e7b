#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/index_set.hpp"
#include "mesh/plane_tree.hpp"
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
  [[nodiscard]] bool blocks(const Corner& corner, const Corner& a, const Corner& b, const Corner& c,
                            Rule rule) const;
  void start_search();
  [[nodiscard]] std::uint32_t find_ear(std::uint32_t from);
  [[nodiscard]] bool is_ear(std::uint32_t tip, Rule rule);
  void clip(std::uint32_t tip);
  void set_reflex(std::uint32_t corner, bool reflex);
  [[nodiscard]] bool is_reflex(const Corner& c) const;
  [[nodiscard]] Triangle triangle_at(std::uint32_t tip) const;

  const std::vector<Point3>& points_;
  std::vector<Corner> corners_;
  PlaneTree blockers_;  ///< corners that were reflex at first: only they can block an ear
  // A corner that was no ear is none until a neighbour goes, or the one that it waits for is no longer
  // reflex.
  struct Waiter {
    std::uint32_t corner;
    Rule rule;
    std::uint32_t next;  ///< of those that wait for the same corner
  };
  std::array<IndexSet, any> candidates_;  ///< by rule: corners not known to be no ears
  std::vector<Waiter> waiters_;
  std::vector<std::uint32_t> first_waiter_;
};

}  // namespace bsp2::model
