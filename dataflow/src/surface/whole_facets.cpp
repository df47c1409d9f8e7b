#include "surface/whole_facets.hpp"

#include <array>
#include <vector>

#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::dataflow {
namespace {

class WholeFacets {
 public:
  WholeFacets(const OperandFacets& source, geometry::Skin& skin)
      : source_(source), skin_(skin), first_(skin.vertices.size()), points_(source.meshes()) {}

  void add(const WholeFacet& whole) {
    const std::uint32_t index = source_.mesh_of(whole.facet), number = source_.number_in_mesh(whole.facet);
    const MeshSurface& mesh = source_.mesh(index);
    const auto outward = source_.outward(whole.facet);
    const auto face = static_cast<std::uint32_t>(skin_.faces.size());
    skin_.faces.push_back({whole.reversed ? outward.opposite() : outward, 0});
    std::array<std::uint32_t, 3> corners;
    for (std::uint32_t k = 0; k < 3; ++k) corners[k] = vertex_of(index, number, k);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t from = corners[k], to = corners[(k + 1) % 3];
      skin_.edges.push_back(
          {whole.reversed ? to : from, whole.reversed ? from : to, face, mesh.across(number, k)});
    }
  }

  void name_all(unsigned threads) {
    constexpr std::size_t grain = 4096;
    skin_.vertices.resize(first_ + vertices_.size());
    geometry::for_each_range(vertices_.size(), grain, threads, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) {
        Vertex& vertex = vertices_[i];
        const auto name = source_.mesh(vertex.mesh).name_of(vertex.facet, vertex.corner);
        skin_.vertices[first_ + i] = name.planes;
        vertex.is_named = name.is_final;
      }
    });
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      const Vertex& vertex = vertices_[i];
      const MeshSurface& mesh = source_.mesh(vertex.mesh);
      const std::uint32_t point = mesh.point(vertex.facet, vertex.corner);
      mesh.append_planes_at(point, skin_.incident);
      skin_.incident_offset.push_back(static_cast<std::uint32_t>(skin_.incident.size()));
      if (vertex.is_named && vertex.facets == mesh.facets_at(point))
        skin_.untouched.push_back(static_cast<std::uint32_t>(first_ + i));
    }
  }

 private:
  struct Vertex {
    std::uint32_t mesh, facet, corner;
    std::uint32_t facets = 0;  ///< that have been added
    bool is_named = false;
  };
  const OperandFacets& source_;
  geometry::Skin& skin_;
  std::size_t first_;
  std::vector<std::vector<std::uint32_t>> points_;  // of each mesh: numbers in vertices_, + 1; 0: not there
  std::vector<Vertex> vertices_;

  std::uint32_t vertex_of(std::uint32_t index, std::uint32_t facet, std::uint32_t corner) {
    const MeshSurface& mesh = source_.mesh(index);
    auto& numbers = points_[index];
    if (numbers.empty()) numbers.assign(mesh.points(), 0);
    std::uint32_t& number = numbers[mesh.point(facet, corner)];
    if (number == 0) {
      vertices_.push_back({index, facet, corner});
      number = static_cast<std::uint32_t>(vertices_.size());
    }
    ++vertices_[number - 1].facets;
    return static_cast<std::uint32_t>(first_ + number - 1);
  }
};

}  // namespace

void add_whole_facets(const OperandFacets& source, std::span<const WholeFacet> facets, unsigned threads,
                      geometry::Skin& skin) {
  WholeFacets whole(source, skin);
  for (const WholeFacet& facet : facets) whole.add(facet);
  whole.name_all(threads);
}

}  // namespace bsp2::dataflow
