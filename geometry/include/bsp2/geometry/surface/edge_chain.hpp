#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::geometry {

/// Sums of directed edges (1-chains), one for each face, over a set of different points.
///
/// What has cancelled is gone: edges that run along each other in opposite directions leave no trace.
using EdgeChain = std::vector<Skin::Edge>;

/// Puts the edges of one face beside each other, the faces in their order; in linear time.
/// @return where those of each face end; one more at the end, which is of no face.
std::vector<std::uint32_t> group_by_face(EdgeChain& edges);

/// Sorts edges by face, and those of one face by `is_before`: linear but for the latter.
template <typename Before>
void sort_by_face(EdgeChain& edges, const Before& is_before) {
  const std::vector<std::uint32_t> begin = group_by_face(edges);
  for (std::size_t face = 0, first = 0; face + 1 < begin.size(); first = begin[face++])
    std::sort(edges.begin() + static_cast<std::ptrdiff_t>(first),
              edges.begin() + static_cast<std::ptrdiff_t>(begin[face]), is_before);
}

/// The lowest of the planes, other than `own`, that two points are known to share.
HyperplaneId common_plane(const PointSet& points, std::uint32_t a, std::uint32_t b, HyperplaneId own);

/// Adds up the edges between the same points in the same face.
void add_up(EdgeChain& edges);

/// Adds up the edges of one plane line by line, whatever their ends are: where they run along each other,
/// their sum counts. Straight runs come out as one edge.
///
/// Edges are on one line if their ends are known to share a second plane. What is not known is left as it is:
/// the sum is the same. Thread rule: one thread at a time.
class LineAdder {
 public:
  explicit LineAdder(ExactPoints& exact) : exact_(exact) {}
  void add_up(const PointSet& points, HyperplaneId plane, EdgeChain& edges);

 private:
  struct Item {
    std::uint64_t line_and_face;
    std::uint32_t from, to;
  };
  struct End {
    std::uint32_t point;
    int change;  // of the sum, on the way along the line
  };
  ExactPoints& exact_;
  std::vector<Item> items_;
  std::vector<End> ends_;

  void add_line(const PointSet& points, std::span<const Item> items, EdgeChain& sum);
};

/// Divides edges where points lie inside them. Exact. Thread rule: one thread at a time, which others help.
class EdgeSplitter {
 public:
  explicit EdgeSplitter(ExactPoints& exact, unsigned threads = 1) : exact_(exact), threads_(threads) {}
  /// At the ends of others.
  void split(const PointSet& points, std::span<const Skin::Face> faces, EdgeChain& edges);
  /// At these points alone.
  void split_at(std::span<const std::uint32_t> some, const PointSet& points,
                std::span<const Skin::Face> faces, EdgeChain& edges);

  /// From the lower end to the higher one; both planes carry it.
  struct Segment {
    std::uint32_t from, to;  // from < to
    HyperplaneId plane, across;
  };
  using Inner = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  ///< segment, point inside it
  /// The ends of segments that lie inside others: segment by segment, from the lower end of each on.
  /// @param segments different ones, by their lower ends.
  const Inner& inner_ends(const PointSet& points, std::vector<Segment> segments);

 private:
  /// A point that may lie in a segment, in a k-d tree.
  struct Candidate {
    std::array<double, 3> x;
    std::uint32_t point;
    int axis;  ///< along which it parts the points before it from those after it
  };

  /// Where a segment begins, how far it goes, and the box that holds all that may lie in it.
  struct Way {
    std::uint32_t number;
    std::array<double, 3> from, step, low, high;
  };

  /// What one thread finds.
  struct Search {
    ExactPoints& exact;
    const PointSet& points;
    Inner& inner;
  };

  /// Segments that only points of a part of the tree may lie on.
  struct Bundle {
    std::span<const Candidate> candidates;
    std::span<std::uint32_t> segments;
    bool is_crossing = false;  ///< each of them may meet what parts the candidates
  };

  ExactPoints& exact_;
  unsigned threads_;
  std::vector<Segment> segments_;
  double margin_ = 0;  // that covers all errors of points
  Inner inner_;

  void collect_segments(std::span<const Skin::Face> faces, const EdgeChain& edges);
  [[nodiscard]] std::vector<bool> ends_of_segments(std::size_t points) const;
  [[nodiscard]] std::vector<Candidate> candidates(const PointSet& points, const std::vector<bool>& is_one);
  void divide(const PointSet& points, const std::vector<bool>& at, EdgeChain& edges);
  static void build(std::span<Candidate> candidates);
  void find_inner(const PointSet& points, std::span<const Candidate> candidates);
  void descend(std::span<const Candidate> candidates, std::span<std::uint32_t> numbers,
               const PointSet& points, std::size_t small, std::vector<Bundle>& bundles) const;
  [[nodiscard]] std::pair<std::size_t, std::size_t> part(const Candidate& middle,
                                                         std::span<std::uint32_t> numbers,
                                                         const PointSet& points) const;
  void find_all(const Search& search, const Bundle& bundle) const;
  [[nodiscard]] Way way_of(const Search& search, std::uint32_t number) const;
  void find(const Search& search, const Way& way, std::span<const Candidate> candidates, double low,
            double high) const;
  static bool is_inside(const Search& search, const Segment& segment, std::uint32_t point);
  void sort_inner(const PointSet& points);
};

}  // namespace bsp2::geometry
