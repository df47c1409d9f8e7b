#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/skin_builder.hpp"
#include "surface/mesh_surface.hpp"
#include "surface/polytope_facets.hpp"
#include "surface/space_share.hpp"

namespace bsp2::dataflow {

/// The facets of the operands of a network that are in some part of space, each by itself: convex polygons
/// with exact corners. Once made, any number of threads may read it.
class OperandFacets {
 public:
  /// Adds hyperplanes to the network's table where it has meshes.
  /// @pre has_plain_facets(network).
  /// @param share the part of space is that of one of so many who share it.
  /// @param stop somebody else ends the work by it: what is there then is not complete.
  OperandFacets(Network<3>& network, unsigned threads, unsigned share, unsigned shares,
                const std::atomic<bool>& stop);

  [[nodiscard]] const SpaceShare& space() const { return space_; }

  /// The facets of a producer are numbered [first(producer), first(producer + 1)).
  [[nodiscard]] std::uint32_t first(std::size_t producer) const { return first_[producer]; }
  [[nodiscard]] std::uint32_t size() const { return first_.back(); }
  /// Bounds of what of a producer is in the model's space, for certain; empty where nothing of it is in this
  /// part. Those of the producer itself are of its own half-spaces, before those of others took the place of
  /// some.
  [[nodiscard]] const Box<3>& bounds(std::size_t producer) const { return bounds_[producer]; }
  /// Whether the facets bound what cells find. Not so where half-spaces of others, in the place of a
  /// producer's own, let it reach beyond its own bounds, since cells do not look for it there; nor where
  /// many facets of a mesh cross or touch each other.
  [[nodiscard]] bool are_sound() const { return are_sound_; }
  [[nodiscard]] bool is_of_mesh(std::uint32_t facet) const { return facets_[facet].kind == Kind::of_mesh; }
  /// Whether it may be that a facet does not bound its mesh: that crosses or touches itself there.
  [[nodiscard]] bool is_doubtful(std::uint32_t facet) const { return facets_[facet].is_doubtful; }
  [[nodiscard]] bool has_doubtful() const { return has_doubtful_; }
  [[nodiscard]] std::size_t meshes() const { return meshes_.size(); }
  [[nodiscard]] const MeshSurface& mesh(std::size_t index) const { return *meshes_[index].surface; }
  /// The index of the mesh that a facet is of, and its number there. @pre is_of_mesh(facet).
  [[nodiscard]] std::uint32_t mesh_of(std::uint32_t facet) const { return facets_[facet].chunk; }
  [[nodiscard]] std::uint32_t number_in_mesh(std::uint32_t facet) const { return facets_[facet].begin; }
  /// The producer on its negative side.
  [[nodiscard]] geometry::OrientedHyperplane outward(std::uint32_t facet) const {
    return facets_[facet].outward;
  }
  /// Counter-clockwise seen from outside.
  void polygon(std::uint32_t facet, geometry::Buffer<geometry::PolygonCorner>& polygon) const {
    const Facet& f = facets_[facet];
    if (f.kind == Kind::of_mesh) return meshes_[f.chunk].surface->polygon(f.begin, polygon);
    const Chunk& chunk = chunks_[f.chunk];
    polygon.clear();
    for (std::uint32_t i = f.begin; i < f.begin + f.count; ++i)
      polygon.push({chunk.vertices[chunk.corners[i].vertex], chunk.corners[i].across});
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
  /// Whether it may reach into the part of space.
  [[nodiscard]] bool is_in_space(std::uint32_t facet) const {
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      if (high(facet, axis) < bounds_of_space_.lower[k] || low(facet, axis) > bounds_of_space_.upper[k])
        return false;
    }
    return true;
  }

 private:
  enum class Kind : std::uint8_t { of_polytope, of_mesh };
  struct Facet {
    geometry::OrientedHyperplane outward;
    std::uint32_t chunk, begin;  ///< of a mesh: the index of that in meshes_, the number within
    std::uint16_t count;
    Kind kind;
    bool is_doubtful;
    std::array<float, 3> low, high;  ///< from the middle of the model's space: it may be far from the origin
  };
  SpaceShare space_ = SpaceShare::whole();
  Box<3> bounds_of_space_ = Box<3>::everything();
  std::array<double, 3> middle_{};    // of the model's space
  double slack_ = 0;                  // more than a sum or difference of its coordinates is rounded by
  std::vector<std::uint32_t> first_;  // of each producer, and the end
  std::vector<Facet> facets_;
  bool are_sound_ = true, has_doubtful_ = false;
  struct PlacedMesh {
    std::size_t producer;
    std::unique_ptr<MeshTopology> topology;
    std::vector<std::uint32_t> doubtful;  ///< ascending
    std::unique_ptr<MeshSurface> surface;
  };
  std::vector<PlacedMesh> meshes_;
  std::vector<Box<3>> bounds_;  // of each producer
  /// Several facets share a vertex.
  struct Chunk {
    geometry::Buffer<geometry::Vertex<3>> vertices;
    geometry::Buffer<PolytopeFacets::Corner> corners;
  };
  std::vector<Chunk> chunks_;

  void find_space(const Network<3>& network, unsigned share, unsigned shares);
  void look_at_meshes(Network<3>& network, unsigned threads, const std::atomic<bool>& stop);
  void set_bounds(const Box<3>& box, Facet& facet) const;
  void add(const PolytopeFacets& polytope, const geometry::HyperplaneTable<3>& table, std::uint32_t chunk,
           std::vector<Facet>& facets);
  void put(std::uint32_t mesh, std::vector<Facet>::iterator first) const;
};

}  // namespace bsp2::dataflow
