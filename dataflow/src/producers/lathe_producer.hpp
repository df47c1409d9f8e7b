#pragma once

#include <optional>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a stack of regular polygons with very many facets.
///
/// Within a wedge around the axis and between two heights, only the facets there bound the stack: the
/// hierarchy over the facets is the range of angles and heights that a cell spans. Where the range holds many
/// facets, the cell is cut by a plane through the axis, or across it, that halves the range; few are asked
/// one by one, as by ConvexProducer. So a cell costs the logarithm of the number of facets.
///
/// State of a leaf: the range (`ranged`), or like ConvexProducer's the half-spaces that cross the cell.
class LatheProducer {
 public:
  LatheProducer(const Network<3>& network, const Producer<3>& producer)
      : network_(network), producer_(producer), lathe_(network.lathes[producer.index]) {}

  geometry::Label ask(const Word* leaf, CellView<3>& cell, Words& out) const;
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  Advice advise(const Word* leaf, CellView<3>& cell) const;

  /// So many facets and more make a lathe of a stack.
  static constexpr std::size_t least_facets = 512;
  /// About so many facets are asked one by one.
  static constexpr std::size_t few_facets = 64;

 private:
  /// Facets of some bands and of some sides; sides go around.
  struct Range {
    std::uint32_t first_band, bands, first_side, sides;
  };
  /// Where the cell is in the lathe's frame: bounds that hold it for certain.
  struct Place {
    double low, high;                            // z
    double farthest, nearest = 0;                // from the axis
    std::optional<std::array<double, 2>> angle;  // none where the axis may go through the cell
  };
  const Network<3>& network_;
  const Producer<3>& producer_;
  const Lathe& lathe_;

  [[nodiscard]] Range whole() const { return {0, lathe_.bands, 0, lathe_.sides}; }
  [[nodiscard]] Range range_of(const Word* leaf) const;
  [[nodiscard]] std::size_t size(const Range& range) const { return std::size_t{range.bands} * range.sides; }
  [[nodiscard]] Place place(const CellView<3>& cell) const;
  void tighten(Range& range, const CellView<3>& cell, const Place& place) const;
  void meet_sides(Range& range, std::uint32_t first, std::uint32_t count) const;
  void meet_bands(Range& range, std::uint32_t first, std::uint32_t end) const;
  [[nodiscard]] double profile(double z) const;
  [[nodiscard]] bool is_outside(const Place& place) const;
  [[nodiscard]] bool is_within_sides(const Place& place) const;
  std::optional<geometry::HyperplaneId> parting(const Range& range, CellView<3>& cell) const;
};

}  // namespace bsp2::dataflow
