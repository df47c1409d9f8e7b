#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/surface/edge_facets.hpp"
#include "bsp2/geometry/surface/plane_names.hpp"
#include "complex/point_register.hpp"

namespace bsp2::meshing {

/// A corner of a convex polygon on a plane: a point, and what carries the edge from there to the next one,
/// with the polygon on its negative side.
struct PolygonCorner {
  std::uint32_t point;
  geometry::OrientedHyperplane across;
};
using Polygon = std::vector<PolygonCorner>;

/// The facets of the IN cells of a mesh, with points that all cells share.
///
/// Shape, for c cells and f facets:
///   part          c      as in CellBatch
///   cell_offset   c + 1  cell i has corners cell_points [cell_offset[i], cell_offset[i + 1])
///   facets        f + 1  facet j has corners [facets[j].begin, facets[j + 1].begin); the last is none
///   corners              counter-clockwise seen from the positive side of the facet's plane
///   planes               name of each plane that carries facets, and of some that carry none
struct CellFacets {
  struct Facet {
    std::uint32_t plane;  ///< among `planes`
    std::int32_t cell;
    std::uint32_t begin;
    bool positive;  ///< the cell is on the positive side of the plane
  };
  std::vector<std::int32_t> part;
  std::vector<std::uint32_t> cell_offset{0}, cell_points;
  std::vector<Facet> facets;
  std::vector<PolygonCorner> corners;
  std::vector<geometry::HyperplaneId> planes;

  [[nodiscard]] std::size_t cells() const { return part.size(); }
  [[nodiscard]] std::size_t size() const { return facets.size() - 1; }
  [[nodiscard]] std::span<const PolygonCorner> polygon(std::uint32_t facet) const {
    return {corners.data() + facets[facet].begin, facets[facet + 1].begin - facets[facet].begin};
  }
};

/// Names the corners of cells. Thread rule: one thread at a time.
class FacetLoader {
 public:
  /// @param families all planes of families that facets are on (geometry::family_planes).
  FacetLoader(geometry::ExactPoints& exact, PointRegister& points,
              std::vector<geometry::HyperplaneId> families);
  /// Those of all IN cells, in their order. May be called again, for more.
  void load(std::span<const std::shared_ptr<const geometry::CellBatch>> batches);
  [[nodiscard]] const CellFacets& facets() const { return result_; }
  CellFacets take();

 private:
  using Ids = std::array<geometry::HyperplaneId, 3>;
  /// A plane by the name that all cells have for it.
  struct Name {
    geometry::OrientedHyperplane outward;  ///< the cell is on its negative side
    std::uint32_t number;                  ///< among all planes here
  };

  geometry::ExactPoints& exact_;
  PointRegister& points_;
  geometry::PlaneNames names_;
  std::unordered_map<geometry::HyperplaneId, Name> known_;            // by ids, of those of no primitive
  std::unordered_map<geometry::HyperplaneId, std::uint32_t> number_;  // by names, likewise
  geometry::EdgeFacets edges_;
  CellFacets result_;
  // Of the cell at hand.
  std::vector<Name> outward_;         // of each facet
  std::vector<Ids> ids_;              // of each corner, the lowest
  std::vector<std::uint16_t> count_;  // of the facets that meet there
  std::vector<geometry::HyperplaneId> planes_;

  [[nodiscard]] Name name(std::int32_t code);
  [[nodiscard]] Name find_name(geometry::HyperplaneId id);
  void load(const geometry::CellBatch& batch, std::uint32_t cell);
  void name_corners(const geometry::CellBatch& batch, std::uint32_t cell);
  void collect_planes(const geometry::CellBatch& batch, std::uint32_t cell, std::uint16_t corner);
  [[nodiscard]] bool turns_right(const geometry::CellBatch& batch, std::uint32_t cell, std::uint32_t facet);
  void add_facet(const geometry::CellBatch& batch, std::uint32_t cell, std::uint32_t facet, bool is_right);
};

}  // namespace bsp2::meshing
