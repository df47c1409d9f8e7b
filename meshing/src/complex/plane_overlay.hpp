#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::meshing {

/// A corner of a convex polygon on a plane: a point, and what carries the edge from there to the next one,
/// with the polygon on its negative side.
struct PolygonCorner {
  std::uint32_t point;
  geometry::OrientedHyperplane across;
};
using Polygon = std::vector<PolygonCorner>;

/// Points by the three planes that name them.
class PointRegister {
 public:
  explicit PointRegister(geometry::ExactPoints& exact) : exact_(exact) {}
  /// The point in which three planes meet; made where it is new.
  std::uint32_t find(geometry::HyperplaneId a, geometry::HyperplaneId b, geometry::HyperplaneId c);
  /// Makes points that are equal one. @return the new number of each old one.
  std::vector<std::uint32_t> unify();
  [[nodiscard]] const geometry::PointSet& points() const { return points_; }

 private:
  /// A place of an open table, which is free where there is no point.
  struct Entry {
    std::array<geometry::HyperplaneId, 3> ids{};
    std::uint32_t point = ~0U;
  };
  geometry::ExactPoints& exact_;
  geometry::PointSet points_;
  std::vector<Entry> known_;  // as many as a power of two, half of them free at least
  std::size_t count_ = 0;

  [[nodiscard]] Entry& place_of(const std::array<geometry::HyperplaneId, 3>& ids);
  void grow();
};

/// A facet of a cell on the plane at hand, counter-clockwise seen from the plane's positive side.
struct PlaneFacet {
  std::int32_t cell;
  bool positive;  ///< the cell is on the positive side of the plane
  Polygon polygon;
};

/// What two cells have in common on the plane, or a cell and the outside.
struct PlanePiece {
  std::int32_t negative, positive;  ///< the cells on the two sides, or Complex::outside
  Polygon polygon;
};

/// Lays the facets on the two sides of a plane over each other. Exact. Thread rule: one thread at a time.
class PlaneOverlay {
 public:
  PlaneOverlay(geometry::ExactPoints& exact, PointRegister& points) : exact_(exact), points_(points) {}
  /// @param facets of one side do not overlap. They are used up.
  void run(geometry::HyperplaneId plane, std::vector<PlaneFacet>& facets, std::vector<PlanePiece>& pieces);

 private:
  struct Facet {
    PlaneFacet* source;
    std::array<double, 3> low, high;
    std::vector<Polygon> left;  // what of it no facet of the other side has covered so far
    bool is_whole = true;       // nothing has
  };
  enum class Overlap { none, some, all };

  geometry::ExactPoints& exact_;
  PointRegister& points_;
  geometry::HyperplaneId plane_ = 0;
  std::vector<int> signs_;

  void take_equal(std::vector<PlaneFacet>& facets, std::vector<PlanePiece>& pieces) const;
  void meet(Facet& negative, Facet& positive, std::vector<PlanePiece>& pieces);
  [[nodiscard]] Overlap overlap(const Polygon& polygon, const Polygon& within);
  int side(std::uint32_t point, geometry::OrientedHyperplane plane);
  void cut(const Polygon& polygon, geometry::OrientedHyperplane by, Polygon& inner, Polygon& outer);
  void subtract(Facet& facet, const Polygon& polygon);
};

}  // namespace bsp2::meshing
