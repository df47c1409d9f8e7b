#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/skin_builder.hpp"

namespace bsp2::dataflow {

/// The facets of all operands of a network, each by itself: convex polygons with exact corners. Once made,
/// any number of threads may read it.
class OperandFacets {
 public:
  /// @pre has_plain_facets(network).
  /// @param stop somebody else ends the work by it: what is there then is not complete.
  OperandFacets(const Network<3>& network, unsigned threads, const std::atomic<bool>& stop);

  /// The facets of a producer are numbered [first(producer), first(producer + 1)).
  [[nodiscard]] std::uint32_t first(std::size_t producer) const { return first_[producer]; }
  [[nodiscard]] std::uint32_t size() const { return first_.back(); }
  /// Bounds of what of a producer is in the model's space, for certain. Those of the producer itself are of
  /// its own half-spaces, before those of others took the place of some.
  [[nodiscard]] const Box<3>& bounds(std::size_t producer) const { return bounds_[producer]; }
  /// Whether half-spaces of others, in the place of a producer's own, let it reach beyond its own bounds.
  /// Cells do not look for it there.
  [[nodiscard]] bool is_any_out_of_bounds() const { return is_any_out_of_bounds_; }
  /// The producer on its negative side.
  [[nodiscard]] geometry::OrientedHyperplane outward(std::uint32_t facet) const {
    return facets_[facet].outward;
  }
  /// Counter-clockwise seen from outside.
  [[nodiscard]] std::span<const geometry::PolygonCorner> polygon(std::uint32_t facet) const {
    const Facet& f = facets_[facet];
    return {chunks_[f.chunk].data() + f.begin, f.count};
  }
  /// Bounds that hold the facet for certain.
  [[nodiscard]] double low(std::uint32_t facet, int axis) const {
    const auto k = static_cast<std::size_t>(axis);
    return middle_[k] + static_cast<double>(facets_[facet].low[k]);
  }
  [[nodiscard]] double high(std::uint32_t facet, int axis) const {
    const auto k = static_cast<std::size_t>(axis);
    return middle_[k] + static_cast<double>(facets_[facet].high[k]);
  }

 private:
  struct Facet {
    geometry::OrientedHyperplane outward;
    std::uint32_t chunk, begin;
    std::uint16_t count;
    std::array<float, 3> low, high;  ///< from the middle of the model's space: it may be far from the origin
  };
  std::array<double, 3> middle_{};    // of the model's space
  double slack_ = 0;                  // more than a sum or difference of its coordinates is rounded by
  std::vector<std::uint32_t> first_;  // of each producer, and the end
  std::vector<Facet> facets_;
  bool is_any_out_of_bounds_ = false;
  std::vector<Box<3>> bounds_;  // of each producer
  std::vector<geometry::Buffer<geometry::PolygonCorner>> chunks_;

  void add(const geometry::CellPolygons& polygons, const geometry::HyperplaneTable<3>& table,
           std::uint32_t chunk, std::vector<Facet>& facets);
};

}  // namespace bsp2::dataflow
