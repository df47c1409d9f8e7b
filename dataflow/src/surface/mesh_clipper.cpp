#include "surface/mesh_clipper.hpp"

#include <algorithm>
#include <utility>

#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::PolygonCorner;
using geometry::PolygonSplitter;

Box<3> bounds_of_polygon(std::span<const PolygonCorner> polygon) {
  Box<3> box = Box<3>::empty();
  for (const PolygonCorner& corner : polygon)
    for (std::size_t k = 0; k < 3; ++k) {
      box.lower[k] = std::min(box.lower[k], corner.point.x[k] - corner.point.error);
      box.upper[k] = std::max(box.upper[k], corner.point.x[k] + corner.point.error);
    }
  return box;
}

bool MeshClipper::part(std::span<const FacetInBox> facets, const Polygon& corners, HyperplaneId plane,
                       std::span<const PolygonCorner> polygon, std::vector<Part>& parts) {
  plane_ = plane;
  parts.clear();
  segments_.clear();
  inner_.clear();
  const Box<3> bounds = bounds_of_polygon(polygon);
  for (const FacetInBox& facet : facets) {
    if (bounds.misses(facet.bounds)) continue;
    const HyperplaneId id = facet.outward.id();
    const unsigned sides = id == plane ? 0 : kernel_.sides(polygon, id);
    if (sides == 0) return false;
    if (sides != 3) continue;  // an edge in the polygon's plane does not lead through the polygon either
    Segment segment{facet.outward, {}};
    const std::span facet_polygon(corners.data() + facet.begin, facet.end - facet.begin);
    const auto meeting = kernel_.meet(facet_polygon, id, plane, segment.ends);
    if (meeting == PolygonSplitter::Meeting::along) return false;
    if (meeting == PolygonSplitter::Meeting::apart) continue;
    if (inner_.empty()) find_inner_sides(polygon);
    if (clip(polygon, segment)) segments_.push_back(segment);
  }
  if (!segments_.empty()) split(polygon, segments_, parts);
  return true;
}

/// Any corner beyond an edge tells.
void MeshClipper::find_inner_sides(std::span<const PolygonCorner> polygon) {
  for (std::size_t i = 0; i < polygon.size(); ++i)
    inner_.push_back(kernel_.sides(polygon.subspan((i + 2) % polygon.size(), 1), polygon[i].across));
}

/// Leaves of a segment what is within the polygon. @return whether it leads through that.
bool MeshClipper::clip(std::span<const PolygonCorner> polygon, Segment& segment) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const unsigned sides = kernel_.sides(segment.ends, polygon[i].across);
    if ((sides & inner_[i]) == 0) return false;
    if (sides == 3) cut(segment, polygon[i].across, inner_[i]);
  }
  return true;
}

/// Leaves what of a segment is on one side of a hyperplane. @pre it has ends on both.
void MeshClipper::cut(Segment& segment, HyperplaneId id, unsigned kept) {
  const bool is_first = kernel_.sides({segment.ends.data(), 1}, id) != kept;
  segment.ends[is_first ? 0 : 1].point = geometry::canonical_vertex(table_, {plane_, segment.facet.id(), id});
}

/// @param segments that lead through the polygon, at least one. A part without any has a whole side of the
/// first one.
void MeshClipper::split(std::span<const PolygonCorner> polygon, std::span<const Segment> segments,
                        std::vector<Part>& parts) {
  const auto facet = segments.front().facet;
  std::array<Polygon, 2> halves;  // on the negative side and on the positive one
  kernel_.split(polygon, plane_, facet.id(), &halves[0], &halves[1]);
  std::array<std::vector<Segment>, 2> rest;
  for (const Segment& segment : segments.subspan(1)) {
    const unsigned sides = kernel_.sides(segment.ends, facet.id());
    for (const unsigned side : {0U, 1U}) {
      if ((sides & (1U << side)) == 0) continue;
      rest[side].push_back(segment);
      if (sides == 3) cut(rest[side].back(), facet.id(), 1U << side);
    }
  }
  for (const unsigned side : {0U, 1U}) {
    const bool is_inside = (side == 0) != facet.flipped();
    if (rest[side].empty())
      parts.push_back({std::move(halves[side]), is_inside ? Label::in : Label::out});
    else
      split({halves[side].data(), halves[side].size()}, rest[side], parts);
  }
}

}  // namespace bsp2::dataflow
