#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "editing/editor.hpp"
#include "shaping/displacement.hpp"
#include "shaping/surface_moves.hpp"

namespace bsp2::meshing {

/// How far the surface of a mesh that is being edited has gone from where it was: since it was last
/// remembered by its points and edges, before that by place.
///
/// Thread rule: one thread at a time.
class Moves {
 public:
  /// @param editor the mesh; it must outlive this.
  explicit Moves(const Editor& editor) : editor_(&editor) {}

  /// Since it was remembered: of a point, and of edges that lead through it.
  [[nodiscard]] Displacement since_at(std::uint32_t p) const;
  /// Of what is this edge of the surface, at a place on it: a mean of its ends, or any of what has become the
  /// edge where that was bent, since its ends may have gone along it since.
  [[nodiscard]] Displacement since_along(std::uint32_t u, std::uint32_t v, const Point& place) const;
  /// Of what has been bent to this edge, with its ends then.
  [[nodiscard]] Displacement bent_along(std::uint32_t u, std::uint32_t v) const;
  /// Of what is at a place of the surface, in all. @param since of it.
  [[nodiscard]] Displacement in_all(const Displacement& since, const Point& place) const;
  [[nodiscard]] bool has_moved(std::uint32_t p) const { return !of_point(moved_, p).is_none(); }

  /// What has become a point has gone so far.
  void move(std::uint32_t p, const Displacement& since) { raise(moved_, p, since); }
  /// Edges that lead through a point have.
  void lead_through(std::uint32_t p, const Displacement& since) { raise(bent_through_, p, since); }
  /// What has become an edge has, somewhere on it.
  void bend(std::uint32_t u, std::uint32_t v, const Displacement& since);
  /// From here on points become others than those that were moved, but the surface is where it is now.
  /// @param reach how far from there a place may be that is asked for.
  void remember(double reach);

 private:
  const Editor* editor_;
  SurfaceMoves before_;
  // Since; by point, and by edge.
  std::vector<Displacement> moved_, bent_through_;
  std::map<std::array<std::uint32_t, 2>, Displacement> bent_;

  static Displacement of_point(const std::vector<Displacement>& of_points, std::uint32_t p) {
    return p < of_points.size() ? of_points[p] : Displacement();
  }
  void raise(std::vector<Displacement>& of_points, std::uint32_t p, const Displacement& moved) const;
};

}  // namespace bsp2::meshing
