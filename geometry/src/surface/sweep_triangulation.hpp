#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::geometry {

/// Triangulates plane regions that are bounded by directed edges, the region on their left: any number of
/// outlines, holes, islands, which may touch in vertices.
///
/// A line sweeps over the plane. Between two neighbouring edges that it crosses with the region between them,
/// a chain of vertices bounds from the left what is not triangulated yet; it bulges to the right, so that all
/// that a new vertex sees of it is at its ends or beside the newest vertex. Every step replaces parts of
/// chains by the other sides of triangles, so the triangles' boundary is that of the region whatever the
/// coordinates are. Cost: n log n but for memory moves. Thread rule: one thread at a time. Source: Hertel,
/// Mehlhorn, "Fast triangulation of the plane with respect to simple polygons" (1985).
class SweepTriangulator {
 public:
  /// @param edges of one face, between points of its plane; no vertex lies inside an edge, no two edges
  /// cross.
  /// @param triangles gets indices of points, counter-clockwise seen from outside.
  /// @throws std::logic_error if the edges bound no region.
  void triangulate(ExactPoints& exact, const PointSet& points, OrientedHyperplane outward,
                   std::span<const Skin::Edge> edges, std::vector<std::array<std::uint32_t, 3>>& triangles);

 private:
  struct Edge {
    std::uint32_t left, right;  // vertices, in the order of the sweep
    bool region_above;
    std::uint32_t chain;  // of the region above, while the sweep line crosses the edge
  };
  /// A vertex of a chain; chains go from the lower edge's left end to the upper one's.
  struct Node {
    std::uint32_t vertex, previous, next;
  };
  struct Chain {
    std::uint32_t first, last, newest;
  };

  const PointSet* points_ = nullptr;
  const PlaneFrame* frame_ = nullptr;
  std::vector<std::array<std::uint32_t, 3>>* triangles_ = nullptr;
  std::vector<std::uint32_t> by_point_, rank_;  // points ascending, and the vertex of each
  std::vector<std::uint32_t>
      vertices_;             // points in the order of the sweep; elsewhere a vertex is an index into it
  std::vector<Edge> edges_;  // by left end, those of one vertex from below to above
  std::vector<std::uint32_t> first_out_, in_count_;
  std::vector<std::uint32_t> crossed_;  // edges that the sweep line crosses, from below to above
  std::vector<Node> nodes_;
  std::vector<Chain> chains_;
  std::vector<std::uint32_t> chain_vertices_, path_;

  [[nodiscard]] int orientation(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  bool is_triangle(std::span<const Skin::Edge> edges);
  void load(std::span<const Skin::Edge> edges);
  void sweep_over(std::uint32_t vertex);
  void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  std::uint32_t new_node(std::uint32_t vertex);
  std::uint32_t new_chain(std::uint32_t vertex);
  void append(Chain& chain, std::uint32_t vertex);
  void prepend(Chain& chain, std::uint32_t vertex);
  std::uint32_t divide(std::uint32_t chain, std::uint32_t vertex);
  void join(std::uint32_t lower, std::uint32_t upper);
  void finish(const Chain& chain, std::uint32_t vertex);
  void emit_fan(std::uint32_t apex, std::span<const std::uint32_t> path);
};

}  // namespace bsp2::geometry
