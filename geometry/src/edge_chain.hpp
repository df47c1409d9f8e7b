#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/contact.hpp"
#include "exact_points.hpp"

namespace bsp2::geometry {

/// Sums of directed edges (1-chains), one for each face, over a set of different points.
///
/// What has cancelled is gone: edges that run along each other in opposite directions leave no trace.
using EdgeChain = std::vector<Skin::Edge>;

/// Adds up the edges between the same points in the same face.
void add_up(EdgeChain& edges);

/// Divides edges so that no end of any of them lies inside another one. Exact. Thread rule: one thread at a time.
class EdgeSplitter {
 public:
  explicit EdgeSplitter(ExactPoints& exact) : exact_(exact) {}
  void split(const PointSet& points, std::span<const Skin::Face> faces, EdgeChain& edges);

 private:
  /// A segment within a box that holds points; `low` and `high` are shares of its length.
  struct Piece {
    std::uint32_t segment;
    double low, high;
  };
  struct Segment {
    std::uint32_t from, to;  // from < to
    HyperplaneId plane, across;
  };
  struct Box {
    std::array<double, 3> low, high;
  };

  ExactPoints& exact_;
  std::vector<Segment> segments_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> inner_;  // segment, point inside it

  void collect_segments(std::span<const Skin::Face> faces, const EdgeChain& edges);
  void find(const PointSet& points, std::span<std::uint32_t> candidates, std::span<const Piece> pieces, double margin);
  bool is_inside(const PointSet& points, const Segment& segment, std::uint32_t point);
  void sort_inner(const PointSet& points);
};

}  // namespace bsp2::geometry
