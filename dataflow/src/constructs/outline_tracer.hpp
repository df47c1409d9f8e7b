#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::dataflow {

/// Gives one number to all rounded positions of one corner: the same point is rounded differently in
/// different cells.
class CornerNumbers {
 public:
  using Point = std::array<double, 2>;
  explicit CornerNumbers(double distance) : distance_(distance) {}
  std::uint32_t number(const Point& point);
  std::vector<Point> points;

 private:
  double distance_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> by_square_;
};

/// A piece of the outline of IN cells, the solid on its left: between two corners, on a line.
struct TracedEdge {
  static constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t from, to, line;
  std::uint32_t beyond = nothing;  ///< number of the FUZZY cell on its other side
};

/// Finds those edges of plane cells that do not cancel, and puts them one after the other.
class OutlineTracer {
 public:
  using Point = CornerNumbers::Point;
  /// @param reach of the coordinates: which corners are one depends on it.
  OutlineTracer(const Network<2>& network, double reach);

  /// A cell of the solid.
  void add(const geometry::CellBatch& batch, std::size_t cell);
  /// A cell beside the solid, to be told where the outline has it. After all cells of the solid.
  void add_beyond(const geometry::CellBatch& batch, std::size_t cell, std::uint32_t number);

  /// The closed paths, each a cycle of edges.
  /// @throws std::logic_error that names the place if they do not close.
  std::vector<std::vector<TracedEdge>> paths();
  [[nodiscard]] const std::vector<Point>& points() const { return corners_.points; }
  /// The corners of a path at which the line changes.
  [[nodiscard]] std::vector<Point> corners_of(const std::vector<TracedEdge>& path) const;

 private:
  const Network<2>& network_;
  CornerNumbers corners_;
  std::vector<TracedEdge> edges_;

  std::vector<std::uint32_t> numbers_of(const geometry::CellBatch& batch, std::size_t cell);
  [[nodiscard]] std::vector<TracedEdge> around(const geometry::CellBatch& batch, std::size_t cell) const;
  void split_at_t_vertices();
  void split_line(std::span<const TracedEdge> line, std::vector<TracedEdge>& pieces) const;
  void cancel();
  static void keep_uncancelled(std::span<const TracedEdge> alike, std::vector<TracedEdge>& left);
  std::vector<std::vector<TracedEdge>> trace();
  void check_end(const std::vector<TracedEdge>& path) const;
  [[nodiscard]] std::size_t next_of(const TracedEdge& edge, const std::vector<bool>& used) const;
};

/// The largest coordinate of a batch.
double reach_of(const geometry::CellBatch& batch);

}  // namespace bsp2::dataflow
