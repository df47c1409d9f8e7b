#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/skin_builder.hpp"
#include "surface/mesh_embedding.hpp"

namespace bsp2::dataflow {

/// The facets of a mesh as convex polygons with exact corners: each corner is where the hyperplane of a facet
/// there, the same whichever facet is asked, meets those beyond its two edges. Between coplanar facets there
/// is none: there the edge gets one of its own, across the facet. Once made, any number of threads may read
/// it.
class MeshSurface {
 public:
  /// Adds hyperplanes to the network's table. @pre the planes of the mesh are exact, and it is surely
  /// embedded.
  MeshSurface(Network<3>& network, const Producer<3>& producer, const MeshTopology& topology);

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(mesh_->facets.size()); }
  [[nodiscard]] geometry::OrientedHyperplane outward(std::uint32_t facet) const {
    return mesh_->facets[facet].plane;
  }
  /// Bounds that hold the facet for certain.
  [[nodiscard]] Box<3> bounds_of(std::uint32_t facet) const;

  /// Counter-clockwise seen from outside.
  void polygon(std::uint32_t facet, geometry::Buffer<geometry::PolygonCorner>& polygon) const;

  [[nodiscard]] std::size_t points() const { return mesh_->points.size(); }
  [[nodiscard]] std::uint32_t point(std::uint32_t facet, std::uint32_t corner) const {
    return topology_->point(facet, corner);
  }
  /// The hyperplane that carries the edge from a corner to the next one.
  [[nodiscard]] geometry::HyperplaneId across(std::uint32_t facet, std::uint32_t corner) const {
    return across_[3 * std::size_t{facet} + corner];
  }
  /// How many facets meet in a point.
  [[nodiscard]] std::size_t facets_at(std::uint32_t point) const { return topology_->around(point).size(); }
  /// Three hyperplanes that meet in the point of a corner, ascending; the same whichever facet is asked.
  struct Name {
    std::array<geometry::HyperplaneId, 3> planes;
    bool is_final;  ///< as the surface names it, where all facets around the point are part of it
  };
  [[nodiscard]] Name name_of(std::uint32_t facet, std::uint32_t corner) const;
  /// Appends the hyperplanes that are known to meet in a point, ascending.
  void append_planes_at(std::uint32_t point, std::vector<geometry::HyperplaneId>& planes) const;

 private:
  using HyperplaneId = geometry::HyperplaneId;
  const Network<3>* network_;
  const Mesh* mesh_;
  const MeshTopology* topology_;
  HyperplaneId first_own_;  // hyperplanes from here on are of edges
  std::vector<HyperplaneId> across_;

  void find_neighbours(geometry::HyperplaneTable<3>& table);
  [[nodiscard]] geometry::Covector<3> across_edge(std::uint32_t facet, std::uint32_t corner) const;
  [[nodiscard]] std::array<HyperplaneId, 3> planes_at(std::uint32_t facet, std::uint32_t corner) const;
  /// By the first of the facets around it, ascending.
  [[nodiscard]] std::array<HyperplaneId, 3> first_planes_at(std::uint32_t point) const;
  [[nodiscard]] double volume_between(const std::array<HyperplaneId, 3>& planes) const;
};

}  // namespace bsp2::dataflow
