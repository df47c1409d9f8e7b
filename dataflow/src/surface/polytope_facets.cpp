#include "surface/polytope_facets.hpp"

#include <algorithm>
#include <utility>

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::OrientedHyperplane;
using Table = geometry::HyperplaneTable<3>;

namespace {

/// Solids of fewer half-spaces are cut out of space as quickly as they are placed.
constexpr std::size_t least_planes = 12;

}  // namespace

PolytopeFacets::PolytopeFacets(const Network<3>& network)
    : network_(network),
      splitter_(network.table),
      clipper_(splitter_),
      kernel_(network.table),
      root_(geometry::root_cell(network.table)) {}

bool PolytopeFacets::load(const Producer<3>& producer) {
  outward_.clear();
  ends_.clear();
  corners_.clear();
  if (producer.is_empty()) return false;
  const auto own = network_.planes_of(producer);
  planes_.assign(own.begin(), own.end());
  Shape* const shape = shape_at_hand();
  if (shape != nullptr && shape->is_known() && place(*shape)) return true;
  if (!cut()) return false;
  if (shape != nullptr && !shape->is_known()) describe(*shape);
  return true;
}

bool PolytopeFacets::cut() {
  clipper_.load(root_);
  left_.assign(network_.table, planes_);
  auto centre = clipper_.centre();
  while (left_.size() > 0) {
    const std::size_t chosen = left_.furthest(centre);
    left_.remove(chosen);
    const auto where = clipper_.cut(planes_[chosen], nullptr);
    if (where == geometry::Position::positive) return false;
    if (where == geometry::Position::crossing && left_.size() > 0) centre = clipper_.centre();
  }
  const geometry::Cell<3> cell = clipper_.cell();
  polygons_.load(kernel_, cell);
  const auto vertices = cell.vertices();
  vertices_.assign(vertices.begin(), vertices.end());
  for (std::size_t facet = 0; facet < polygons_.size(); ++facet) {
    outward_.push_back(polygons_.outward(facet));
    corners_.append(polygons_.polygon(facet));
    ends_.push_back(static_cast<std::uint32_t>(corners_.size()));
  }
  return true;
}

/// As the others of its shape. @return whether all of it is in the model's space.
bool PolytopeFacets::place(const Shape& shape) {
  std::uint64_t unused = 0;
  vertices_.clear();
  for (const auto& [a, b, c] : shape.vertices) {
    std::array<HyperplaneId, 3> name{planes_[a].id(), planes_[b].id(), planes_[c].id()};
    std::ranges::sort(name);
    vertices_.push_back(geometry::make_vertex<3>(network_.table, name, unused));
    if (!is_in_space(vertices_.back())) return false;
  }
  for (const std::uint32_t plane : shape.planes) outward_.push_back(planes_[plane]);
  ends_ = shape.ends;
  for (const auto& [vertex, across] : shape.corners) corners_.push({vertex, planes_[across].id()});
  return true;
}

bool PolytopeFacets::is_in_space(const geometry::Vertex<3>& vertex) const {
  for (int axis = 0; axis < 3; ++axis) {
    const double x = vertex.x[static_cast<std::size_t>(axis)];
    if (!(x - vertex.error > network_.table.axis_value(axis, network_.table.root_lower()) &&
          x + vertex.error < network_.table.axis_value(axis, network_.table.root_upper())))
      return false;
  }
  return true;
}

/// What is known of the shape at hand: of producers that one map places, all of whose half-spaces are their
/// own, or are equal to these. Sorts the planes by their place in the shape. @return null for others.
PolytopeFacets::Shape* PolytopeFacets::shape_at_hand() {
  if (planes_.size() < least_planes) return nullptr;
  const Table& table = network_.table;
  for (const OrientedHyperplane plane : planes_)
    if (plane.flipped() || table.source(plane.id()) == nullptr) return nullptr;
  // Those of others had their numbers before.
  const std::uint32_t map = table.source(planes_.back().id())->map;
  std::ranges::sort(planes_, {}, [&](OrientedHyperplane p) { return table.source(p.id())->covector; });
  covectors_.clear();
  for (const OrientedHyperplane plane : planes_) {
    covectors_.push_back(table.source(plane.id())->covector);
    if (!is_placed_by(map, plane.id())) return nullptr;
  }
  const int orientation = table.orientation(map);
  if (orientation == 0) return nullptr;
  const auto [at, is_new] =
      shapes_.try_emplace(std::uint64_t{covectors_.front()} << 1 | (orientation < 0 ? 1 : 0));
  Shape& shape = at->second;
  if (is_new) {
    shape.covectors = covectors_;
    return nullptr;
  }
  return shape.covectors == covectors_ ? &shape : nullptr;
}

/// Whether the map would place a hyperplane of its frame where it is.
bool PolytopeFacets::is_placed_by(std::uint32_t map, HyperplaneId id) const {
  const Table& table = network_.table;
  const auto* const source = table.source(id);
  if (source->map == map) return true;
  geometry::ExactCovector<3> placed;
  table.map(map).map(table.covector(source->covector), placed);
  return placed == table.exact(id);
}

/// The producer at hand as a shape; that stays unknown where space ends within it, or at a corner, which may
/// have its name from the end of space.
void PolytopeFacets::describe(Shape& shape) const {
  std::unordered_map<HyperplaneId, std::uint32_t> number;
  for (const OrientedHyperplane plane : planes_)
    number.emplace(plane.id(), static_cast<std::uint32_t>(number.size()));
  Shape known{.covectors = shape.covectors, .vertices = {}, .planes = {}, .ends = ends_, .corners = {}};
  for (const OrientedHyperplane plane : outward_) {
    if (!number.contains(plane.id())) return;
    known.planes.push_back(number[plane.id()]);
  }
  for (const auto& vertex : vertices_) {
    const auto& [a, b, c] = vertex.hyperplanes;
    if (!number.contains(a) || !number.contains(b) || !number.contains(c)) return;
    known.vertices.push_back({number.at(a), number.at(b), number.at(c)});
  }
  for (const auto& [vertex, across] : corners_) known.corners.push_back({vertex, number.at(across)});
  shape = std::move(known);
}

}  // namespace bsp2::dataflow
