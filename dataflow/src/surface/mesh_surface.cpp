#include "surface/mesh_surface.hpp"

#include <algorithm>
#include <cmath>

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::PolygonCorner;
using Table = geometry::HyperplaneTable<3>;

MeshSurface::MeshSurface(Network<3>& network, const Producer<3>& producer, const MeshTopology& topology)
    : network_(&network),
      mesh_(&network.meshes[producer.index]),
      topology_(&topology),
      first_own_(static_cast<HyperplaneId>(network.table.size())) {
  find_neighbours(network.table);
}

void MeshSurface::find_neighbours(Table& table) {
  across_.resize(3 * std::size_t{size()});
  std::vector<std::array<std::uint32_t, 4>> flat;  // edges between coplanar facets: seen from either side
  for (std::uint32_t facet = 0; facet < size(); ++facet)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t other = topology_->beyond(facet, k);
      const HyperplaneId theirs = outward(other).id();
      across_[3 * std::size_t{facet} + k] = theirs;
      if (theirs != outward(facet).id()) continue;
      if (facet > other) continue;
      std::uint32_t back = 0;
      while (topology_->point(other, back) != topology_->point(facet, (k + 1) % 3)) ++back;
      flat.push_back({facet, k, other, back});
    }
  if (flat.empty()) return;
  std::vector<geometry::Covector<3>> covectors;
  covectors.reserve(flat.size());
  for (const auto& edge : flat) covectors.push_back(across_edge(edge[0], edge[1]));
  HyperplaneId next = table.add_apart(mesh_->first.map, covectors);
  for (const auto& [facet, k, other, back] : flat) {
    across_[3 * std::size_t{facet} + k] = next;
    across_[3 * std::size_t{other} + back] = next++;
  }
}

/// A plane through an edge, far from parallel to the facet: through a point beside the edge along an axis.
geometry::Covector<3> MeshSurface::across_edge(std::uint32_t facet, std::uint32_t corner) const {
  const std::uint32_t from = point(facet, corner), to = point(facet, (corner + 1) % 3);
  const auto& covector = network_->table.covector(mesh_->first.covector + facet).rounded;
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::fabs(covector[k]) > std::fabs(covector[axis])) axis = k;
  constexpr std::int64_t half = std::int64_t{1} << 52;
  auto beside = mesh_->frame_points[from];
  beside[axis] += beside[axis] > 0 ? -half : half;
  auto plane = geometry::triangle_covector({mesh_->frame_points[from], mesh_->frame_points[to], beside});
  plane.points = {from + 1, to + 1, 0};
  return plane;
}

std::array<HyperplaneId, 3> MeshSurface::planes_at(std::uint32_t facet, std::uint32_t corner) const {
  return {outward(facet).id(), across(facet, (corner + 2) % 3), across(facet, corner)};
}

std::array<HyperplaneId, 3> MeshSurface::first_planes_at(std::uint32_t point) const {
  const FacetCorner& first = topology_->around(point).front();
  auto planes = planes_at(first.facet, first.number);
  std::sort(planes.begin(), planes.end());
  return planes;
}

double MeshSurface::volume_between(const std::array<HyperplaneId, 3>& planes) const {
  const auto a = network_->table.rounded(planes[0]).normal, b = network_->table.rounded(planes[1]).normal,
             c = network_->table.rounded(planes[2]).normal;
  return std::fabs(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0]));
}

Box<3> MeshSurface::bounds_of(std::uint32_t facet) const {
  Box<3> box = Box<3>::empty();
  for (std::uint32_t k = 0; k < 3; ++k) {
    const auto& x = mesh_->points[point(facet, k)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.lower[axis] = std::min(box.lower[axis], x[axis] - mesh_->error);
      box.upper[axis] = std::max(box.upper[axis], x[axis] + mesh_->error);
    }
  }
  return box;
}

void MeshSurface::polygon(std::uint32_t facet, geometry::Buffer<PolygonCorner>& polygon) const {
  polygon.clear();
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t at = point(facet, k);
    polygon.push({{mesh_->points[at], mesh_->error, first_planes_at(at)}, across(facet, k)});
  }
}

/// By those of the lowest hyperplanes that are farthest from parallel, as the surface does.
MeshSurface::Name MeshSurface::name_of(std::uint32_t facet, std::uint32_t corner) const {
  constexpr std::size_t most = 8;
  constexpr double surely_independent = 0x1p-20;
  const std::uint32_t at = point(facet, corner);
  const std::span all(mesh_->incident.data() + mesh_->incident_offset[at],
                      mesh_->incident_offset[at + 1] - mesh_->incident_offset[at]);
  const auto some = all.first(std::min(all.size(), most));
  double largest = surely_independent;
  std::array<HyperplaneId, 3> name{};
  for (std::size_t i = 0; i < some.size(); ++i)
    for (std::size_t j = i + 1; j < some.size(); ++j)
      for (std::size_t k = j + 1; k < some.size(); ++k) {
        const double volume = volume_between({some[i], some[j], some[k]});
        if (volume <= largest) continue;
        largest = volume;
        name = {some[i], some[j], some[k]};
      }
  if (largest > surely_independent) return {name, true};
  return {first_planes_at(at), false};
}

void MeshSurface::append_planes_at(std::uint32_t point, std::vector<HyperplaneId>& planes) const {
  const auto first = mesh_->incident.begin() + mesh_->incident_offset[point],
             last = mesh_->incident.begin() + mesh_->incident_offset[point + 1];
  planes.insert(planes.end(), first, last);
  if (network_->table.size() == first_own_) return;
  const auto own = static_cast<std::ptrdiff_t>(planes.size());
  for (const FacetCorner& corner : topology_->around(point))
    if (const HyperplaneId id = across(corner.facet, corner.number); id >= first_own_) planes.push_back(id);
  std::sort(planes.begin() + own, planes.end());
}

}  // namespace bsp2::dataflow
