#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/geometry/surface/skin_builder.hpp"

namespace bsp2::dataflow {

/// A facet of an operand within a box.
struct FacetInBox {
  geometry::OrientedHyperplane outward;
  std::uint32_t facet;       ///< of OperandFacets
  std::uint32_t begin, end;  ///< of its polygon there, among the corners of all
  Box<3> bounds;             ///< that hold the polygon for certain
};

/// Bounds that hold a polygon for certain.
[[nodiscard]] Box<3> bounds_of_polygon(std::span<const geometry::PolygonCorner> polygon);

/// Parts convex polygons by the facets of a mesh that cross them: a binary space partition in the polygon's
/// plane, by the segments that the facets have there. Each part has a whole side of the segment that it was
/// cut off by, and so that facet tells where it is; no point is looked for. Thread rule: one thread at a
/// time.
///
/// Source: Trettner, Nehring-Wirxel, Kobbelt, "EMBER: exact mesh booleans via efficient and robust local
/// arrangements" (2022).
class MeshClipper {
 public:
  using Polygon = geometry::Buffer<geometry::PolygonCorner>;
  /// Of a polygon, with where it is to an operand.
  struct Part {
    Polygon polygon;
    geometry::Label label;
  };

  MeshClipper(const geometry::HyperplaneTable<3>& table, geometry::PolygonSplitter& kernel)
      : table_(table), kernel_(kernel) {}
  /// @param facets of a mesh that is surely embedded: all in the box that holds the polygon; `corners` has
  /// theirs. @param plane in which the polygon lies. @param parts of it; none if no facet crosses it.
  /// @return false where a facet has an edge in the polygon's plane, or lies there: then it is not told.
  [[nodiscard]] bool part(std::span<const FacetInBox> facets, const Polygon& corners,
                          geometry::HyperplaneId plane, std::span<const geometry::PolygonCorner> polygon,
                          std::vector<Part>& parts);

 private:
  /// What a facet has in the polygon's plane, within the polygon.
  struct Segment {
    geometry::OrientedHyperplane facet;
    std::array<geometry::PolygonCorner, 2> ends;  ///< their edges do not matter
  };
  const geometry::HyperplaneTable<3>& table_;
  geometry::PolygonSplitter& kernel_;
  geometry::HyperplaneId plane_ = 0;
  std::vector<Segment> segments_;
  std::vector<unsigned> inner_;  // the side that the polygon has of each edge's hyperplane

  void find_inner_sides(std::span<const geometry::PolygonCorner> polygon);
  bool clip(std::span<const geometry::PolygonCorner> polygon, Segment& segment);
  void cut(Segment& segment, geometry::HyperplaneId id, unsigned kept);
  void split(std::span<const geometry::PolygonCorner> polygon, std::span<const Segment> segments,
             std::vector<Part>& parts);
};

}  // namespace bsp2::dataflow
