#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/cells/clipper.hpp"
#include "bsp2/geometry/cells/halfspace_columns.hpp"
#include "bsp2/geometry/surface/skin_builder.hpp"

namespace bsp2::dataflow {

/// The facets of convex producers, one after the other. Thread rule: one thread at a time.
///
/// Each is cut out of space by its half-spaces. How facets hang together an affine map does not change: of
/// many producers that are made of one shape only two are cut, the others are placed like these.
class PolytopeFacets {
 public:
  explicit PolytopeFacets(const Network<3>& network);

  /// @return whether the producer has any.
  bool load(const Producer<3>& producer);
  [[nodiscard]] std::size_t size() const { return outward_.size(); }
  /// The hyperplane of a facet, the producer on its negative side.
  [[nodiscard]] geometry::OrientedHyperplane outward(std::size_t facet) const { return outward_[facet]; }
  using Corner = geometry::CellPolygons::Corner;
  /// Counter-clockwise seen from outside.
  [[nodiscard]] std::span<const Corner> polygon(std::size_t facet) const {
    const std::uint32_t begin = facet == 0 ? 0 : ends_[facet - 1];
    return {corners_.data() + begin, ends_[facet] - begin};
  }
  [[nodiscard]] std::span<const geometry::Vertex<3>> vertices() const { return vertices_; }

 private:
  /// Planes are numbered in the order of their covectors.
  struct Shape {
    struct Corner {
      std::uint32_t vertex, across;  ///< numbers of a vertex, and of a plane
    };
    std::vector<std::uint32_t> covectors;  ///< of all its planes
    std::vector<std::array<std::uint32_t, 3>> vertices;
    std::vector<std::uint32_t> planes, ends;  ///< of the facets: where their corners end
    std::vector<Corner> corners;
    [[nodiscard]] bool is_known() const { return !corners.empty(); }
  };

  const Network<3>& network_;
  geometry::Splitter<3> splitter_;
  geometry::Clipper<3> clipper_;
  geometry::PolygonSplitter kernel_;
  geometry::Cell<3> root_;
  geometry::HalfspaceColumns<3> left_;
  geometry::CellPolygons polygons_;
  std::unordered_map<std::uint64_t, Shape> shapes_;
  std::vector<std::uint32_t> covectors_;
  // Of the producer at hand.
  std::vector<geometry::Vertex<3>> vertices_;
  std::vector<geometry::OrientedHyperplane> planes_;
  std::vector<geometry::OrientedHyperplane> outward_;
  std::vector<std::uint32_t> ends_;
  geometry::Buffer<Corner> corners_;

  [[nodiscard]] bool cut();
  [[nodiscard]] bool place(const Shape& shape);
  [[nodiscard]] bool is_in_space(const geometry::Vertex<3>& vertex) const;
  [[nodiscard]] Shape* shape_at_hand();
  [[nodiscard]] bool is_placed_by(std::uint32_t map, geometry::HyperplaneId id) const;
  void describe(Shape& shape) const;
};

}  // namespace bsp2::dataflow
