#include "surface/operand_facets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::dataflow {

namespace {

constexpr std::uint32_t no_mesh = ~0U;

void unite_with(const geometry::Vertex<3>& vertex, Box<3>& box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.lower[axis] = std::min(box.lower[axis], vertex.x[axis] - vertex.error);
    box.upper[axis] = std::max(box.upper[axis], vertex.x[axis] + vertex.error);
  }
}

Box<3> bounds_of(const PolytopeFacets& polytope) {
  Box<3> box = Box<3>::empty();
  for (const auto& vertex : polytope.vertices()) unite_with(vertex, box);
  return box;
}

Box<3> bounds_of(const PolytopeFacets& polytope, std::size_t facet) {
  Box<3> box = Box<3>::empty();
  for (const auto& corner : polytope.polygon(facet)) unite_with(polytope.vertices()[corner.vertex], box);
  return box;
}

float below(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded <= x ? rounded : std::nextafter(rounded, -std::numeric_limits<float>::infinity());
}
float above(double x) { return -below(-x); }

}  // namespace

OperandFacets::OperandFacets(Network<3>& network, unsigned threads, unsigned share, unsigned shares,
                             const std::atomic<bool>& stop) {
  using Table = geometry::HyperplaneTable<3>;
  for (int axis = 0; axis < 3; ++axis)
    middle_[static_cast<std::size_t>(axis)] = network.table.axis_value(axis, Table::axis_steps / 2);
  slack_ = 0x1p-50 * network.table.radius();
  look_at_meshes(network, threads, stop);
  if (!are_sound_ || stop) return;
  if (shares > 1) find_space(network, share, shares);
  // So many producers a thread takes at a time; their corners are a chunk.
  const std::size_t count = network.producers.size(), grain = count / (4 * std::max(1U, threads)) + 1,
                    chunks = (count + grain - 1) / grain;
  chunks_.resize(chunks);
  std::vector<std::vector<Facet>> facets(chunks);  // of convex producers
  std::vector<std::uint32_t> mesh_of(count, no_mesh);
  for (std::uint32_t mesh = 0; mesh < meshes_.size(); ++mesh) mesh_of[meshes_[mesh].producer] = mesh;
  bounds_.assign(count, Box<3>::empty());
  first_.assign(count + 1, 0);
  geometry::for_each_range(count, grain, threads, [&](std::size_t first, std::size_t end) {
    const std::size_t chunk = first / grain;
    PolytopeFacets polytope(network);
    for (std::size_t producer = first; producer < end && !stop; ++producer) {
      std::uint32_t& size = first_[producer + 1];
      const std::size_t before = facets[chunk].size();
      if (mesh_of[producer] != no_mesh) {
        bounds_[producer] = network.producers[producer];
        size = meshes_[mesh_of[producer]].surface->size();
      } else if (!bounds_of_space_.misses(network.producers[producer]) &&
                 polytope.load(network.producers[producer])) {
        bounds_[producer] = bounds_of(polytope);
        add(polytope, network.table, static_cast<std::uint32_t>(chunk), facets[chunk]);
        size = static_cast<std::uint32_t>(facets[chunk].size() - before);
      }
    }
  });
  if (stop) return;
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  facets_.resize(first_.back());
  geometry::for_each_range(count, grain, threads, [&](std::size_t first, std::size_t end) {
    auto& some = facets[first / grain];
    auto from = some.begin();
    for (std::size_t producer = first; producer < end; ++producer) {
      const auto to = facets_.begin() + first_[producer];
      if (mesh_of[producer] != no_mesh) {
        put(mesh_of[producer], to);
      } else {
        const auto next = from + (first_[producer + 1] - first_[producer]);
        std::copy(from, next, to);
        from = next;
      }
    }
    some = std::decay_t<decltype(some)>();  // its memory, too
  });
  const double margin = 0x1p-40 * network.table.radius();  // more than corners are rounded by
  for (std::size_t producer = 0; producer < count; ++producer)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (bounds_[producer].lower[axis] < network.producers[producer].lower[axis] - margin ||
          bounds_[producer].upper[axis] > network.producers[producer].upper[axis] + margin)
        are_sound_ = false;
}

/// What is shared are operands, and of meshes facets.
void OperandFacets::find_space(const Network<3>& network, unsigned share, unsigned shares) {
  std::vector<SharedItem> items;
  for (const Producer<3>& producer : network.producers)
    if (producer.kind != ProducerKind::mesh && !producer.is_empty())
      items.push_back({producer, static_cast<double>(producer.plane_count)});
  for (const PlacedMesh& mesh : meshes_)
    for (std::uint32_t number = 0; number < mesh.surface->size(); ++number)
      items.push_back({mesh.surface->bounds_of(number), 1});
  space_ = share_of_space(network, items, share, shares);
  bounds_of_space_ = space_.bounds(network.table);
}

/// Several at a time are held against themselves; then planes are added in their order.
void OperandFacets::look_at_meshes(Network<3>& network, unsigned threads, const std::atomic<bool>& stop) {
  for (std::size_t i = 0; i < network.producers.size(); ++i)
    if (network.producers[i].kind == ProducerKind::mesh && !network.producers[i].is_empty())
      meshes_.push_back({i, nullptr, {}, nullptr});
  std::atomic<bool> are_sound = true;
  geometry::for_each_range(meshes_.size(), 1, threads, [&](std::size_t first, std::size_t) {
    if (stop || !are_sound) return;
    const Producer<3>& producer = network.producers[meshes_[first].producer];
    Mesh& mesh = network.meshes[producer.index];
    if (mesh.is_exact) meshes_[first].topology = std::make_unique<MeshTopology>(mesh);
    const auto* topology = meshes_[first].topology.get();
    std::optional<std::vector<std::uint32_t>> doubtful;
    if (topology != nullptr && topology->is_manifold())
      doubtful = doubtful_facets(network, producer, *topology);
    if (!doubtful) are_sound = false;
    mesh.is_embedded = doubtful && doubtful->empty();
    meshes_[first].doubtful = std::move(doubtful).value_or(std::vector<std::uint32_t>());
  });
  are_sound_ = are_sound;
  for (PlacedMesh& mesh : meshes_) {
    if (!are_sound_ || stop) return;
    has_doubtful_ = has_doubtful_ || !mesh.doubtful.empty();
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
  auto& [vertices, corners] = chunks_[chunk];
  const auto first_vertex = static_cast<std::uint32_t>(vertices.size());
  vertices.append(polytope.vertices());
  for (std::size_t i = 0; i < polytope.size(); ++i) {
    const auto outward = polytope.outward(i);
    if (outward.id() >= table.size()) continue;  // the end of space
    const auto polygon = polytope.polygon(i);
    Facet facet{outward,
                chunk,
                static_cast<std::uint32_t>(corners.size()),
                static_cast<std::uint16_t>(polygon.size()),
                Kind::of_polytope,
                false,
                {},
                {}};
    set_bounds(bounds_of(polytope, i), facet);
    for (const auto& [vertex, across] : polygon) corners.push({first_vertex + vertex, across});
    facets.push_back(facet);
  }
}

void OperandFacets::put(std::uint32_t mesh, std::vector<Facet>::iterator first) const {
  const MeshSurface& surface = *meshes_[mesh].surface;
  auto to = first;
  for (std::uint32_t number = 0; number < surface.size(); ++number, ++to) {
    *to = {surface.outward(number), mesh, number, 0, Kind::of_mesh, false, {}, {}};
    set_bounds(surface.bounds_of(number), *to);
  }
  for (const std::uint32_t number : meshes_[mesh].doubtful) (first + number)->is_doubtful = true;
}

}  // namespace bsp2::dataflow
