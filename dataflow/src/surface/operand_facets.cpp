#include "surface/operand_facets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::dataflow {

using geometry::PolygonCorner;

namespace {

constexpr std::uint32_t no_mesh = ~0U;

Box<3> bounds_of(std::span<const PolygonCorner> polygon) {
  Box<3> box = Box<3>::empty();
  for (const PolygonCorner& corner : polygon)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.lower[axis] = std::min(box.lower[axis], corner.point.x[axis] - corner.point.error);
      box.upper[axis] = std::max(box.upper[axis], corner.point.x[axis] + corner.point.error);
    }
  return box;
}

Box<3> bounds_of(const PolytopeFacets& polytope) {
  Box<3> box = Box<3>::empty();
  for (std::size_t i = 0; i < polytope.size(); ++i) box.unite(bounds_of(polytope.polygon(i)));
  return box;
}

float below(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded <= x ? rounded : std::nextafter(rounded, -std::numeric_limits<float>::infinity());
}
float above(double x) { return -below(-x); }

}  // namespace

OperandFacets::OperandFacets(Network<3>& network, unsigned threads, const std::atomic<bool>& stop) {
  using Table = geometry::HyperplaneTable<3>;
  for (int axis = 0; axis < 3; ++axis)
    middle_[static_cast<std::size_t>(axis)] = network.table.axis_value(axis, Table::axis_steps / 2);
  slack_ = 0x1p-50 * network.table.radius();
  look_at_meshes(network, threads, stop);
  if (!are_sound_ || stop) return;
  // So many producers a thread takes at a time; their corners are a chunk.
  const std::size_t count = network.producers.size(), grain = count / (4 * std::max(1U, threads)) + 1,
                    chunks = (count + grain - 1) / grain;
  chunks_.resize(chunks);
  std::vector<std::vector<Facet>> facets(chunks);
  std::vector<std::uint32_t> sizes(count), mesh_of(count, no_mesh);
  for (std::uint32_t mesh = 0; mesh < meshes_.size(); ++mesh) mesh_of[meshes_[mesh].producer] = mesh;
  bounds_.assign(count, Box<3>::empty());
  geometry::for_each_range(count, grain, threads, [&](std::size_t first, std::size_t end) {
    const std::size_t chunk = first / grain;
    PolytopeFacets polytope(network);
    for (std::size_t producer = first; producer < end && !stop; ++producer) {
      const std::size_t before = facets[chunk].size();
      if (mesh_of[producer] != no_mesh) {
        bounds_[producer] = network.producers[producer];
        add(mesh_of[producer], facets[chunk]);
      } else if (polytope.load(network.producers[producer])) {
        bounds_[producer] = bounds_of(polytope);
        add(polytope, network.table, static_cast<std::uint32_t>(chunk), facets[chunk]);
      }
      sizes[producer] = static_cast<std::uint32_t>(facets[chunk].size() - before);
    }
  });
  first_.reserve(count + 1);
  first_.push_back(0);
  for (const std::uint32_t size : sizes) first_.push_back(first_.back() + size);
  facets_.reserve(first_.back());
  for (auto& some : facets) {
    facets_.insert(facets_.end(), some.begin(), some.end());
    some = {};
  }
  const double margin = 0x1p-40 * network.table.radius();  // more than corners are rounded by
  for (std::size_t producer = 0; producer < count; ++producer)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (bounds_[producer].lower[axis] < network.producers[producer].lower[axis] - margin ||
          bounds_[producer].upper[axis] > network.producers[producer].upper[axis] + margin)
        are_sound_ = false;
}

/// Several at a time are held against themselves; then planes are added in their order.
void OperandFacets::look_at_meshes(Network<3>& network, unsigned threads, const std::atomic<bool>& stop) {
  for (std::size_t i = 0; i < network.producers.size(); ++i)
    if (network.producers[i].kind == ProducerKind::mesh && !network.producers[i].is_empty())
      meshes_.push_back({i, nullptr, nullptr});
  std::atomic<bool> are_sound = true;
  geometry::for_each_range(meshes_.size(), 1, threads, [&](std::size_t first, std::size_t) {
    if (stop || !are_sound) return;
    const Producer<3>& producer = network.producers[meshes_[first].producer];
    const Mesh& mesh = network.meshes[producer.index];
    if (mesh.is_exact) meshes_[first].topology = std::make_unique<MeshTopology>(mesh);
    const auto* topology = meshes_[first].topology.get();
    if (topology == nullptr || !topology->is_manifold() || !is_surely_embedded(network, producer, *topology))
      are_sound = false;
  });
  are_sound_ = are_sound;
  for (PlacedMesh& mesh : meshes_) {
    if (!are_sound_ || stop) return;
    mesh.surface = std::make_unique<MeshSurface>(network, network.producers[mesh.producer], *mesh.topology);
  }
}

void OperandFacets::set_bounds(const Box<3>& box, Facet& facet) const {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    facet.low[axis] = below(box.lower[axis] - middle_[axis] - slack_);
    facet.high[axis] = above(box.upper[axis] - middle_[axis] + slack_);
  }
}

void OperandFacets::add(const PolytopeFacets& polytope, const geometry::HyperplaneTable<3>& table,
                        std::uint32_t chunk, std::vector<Facet>& facets) {
  for (std::size_t i = 0; i < polytope.size(); ++i) {
    const auto outward = polytope.outward(i);
    if (outward.id() >= table.size()) continue;  // the end of space
    const auto polygon = polytope.polygon(i);
    Facet facet{outward,
                chunk,
                static_cast<std::uint32_t>(chunks_[chunk].size()),
                static_cast<std::uint16_t>(polygon.size()),
                Kind::of_polytope,
                {},
                {}};
    set_bounds(bounds_of(polygon), facet);
    chunks_[chunk].append(polygon);
    facets.push_back(facet);
  }
}

void OperandFacets::add(std::uint32_t mesh, std::vector<Facet>& facets) const {
  const MeshSurface& surface = *meshes_[mesh].surface;
  facets.reserve(facets.size() + surface.size());
  for (std::uint32_t number = 0; number < surface.size(); ++number) {
    Facet facet{surface.outward(number), mesh, number, 0, Kind::of_mesh, {}, {}};
    set_bounds(surface.bounds_of(number), facet);
    facets.push_back(facet);
  }
}

}  // namespace bsp2::dataflow
