#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/exact_points.hpp"
#include "complex/cell_facets.hpp"

namespace bsp2::meshing {

/// What two cells have in common on a plane, or a cell and the outside: a convex polygon, counter-clockwise
/// seen from the positive side.
struct PlanePiece {
  std::int32_t negative, positive;  ///< the cells on the two sides, or Complex::outside
  geometry::HyperplaneId plane;
  std::uint32_t begin, count;  ///< its corners, among those of the facets
};

/// Lays the facets on the two sides of a plane over each other. Exact. What becomes of a facet depends on
/// those that it meets alone. Thread rule: one thread at a time,
/// beside others that have overlays of their own.
class PlaneOverlay {
 public:
  /// What comes of some planes. Points and corners that are new have numbers from those of what was there on.
  struct Result {
    std::vector<PlanePiece> pieces;
    std::vector<PolygonCorner> corners;
    geometry::PointSet points;
  };
  PlaneOverlay(geometry::ExactPoints& exact, const PointRegister& named, const CellFacets& facets)
      : exact_(exact), named_(named), points_(named.points()), facets_(facets) {}
  /// @param on_plane all facets on one plane; those of one side do not overlap.
  void run(std::span<const std::uint32_t> on_plane, Result& result);

 private:
  struct Facet {
    std::uint32_t source;
    std::array<double, 3> low, high;
    bool is_covered = false;      // by one facet of the other side
    std::uint32_t shared = none;  // the last of its pieces that others have, too: in `shared_`
  };
  /// A piece that a facet has in common with one of the other side.
  struct Shared {
    std::uint32_t piece;    // of the result
    std::uint32_t earlier;  // another one of the facet, or none
  };
  /// Where a line of the plane begins or ends to be a facet's edge: on which it is, and in which point.
  using LineEnd = std::pair<std::uint64_t, int>;
  /// Where a line of the plane crosses another one: a place of an open table.
  struct Crossing {
    std::uint64_t lines = 0;
    std::uint32_t point = 0;
    std::uint32_t round = 0;  ///< in which it was found: before the plane at hand, and it is free
  };
  using Hash = std::pair<std::uint64_t, std::uint32_t>;
  enum class Overlap { none, some, all };
  static constexpr std::uint32_t none = ~0U;

  geometry::ExactPoints& exact_;
  const PointRegister& named_;
  const geometry::PointSet& points_;
  const CellFacets& facets_;
  Result* result_ = nullptr;
  geometry::HyperplaneId plane_ = 0;
  std::size_t axis_ = 0;  // along which the sweep goes
  // Each keeps its memory from one plane to the next.
  std::vector<Crossing> crossings_;  // as many as a power of two, half of them free at least
  std::uint32_t round_ = 0;
  std::size_t crossing_count_ = 0;
  std::vector<std::uint32_t> rest_;
  std::vector<Hash> hashes_;
  std::array<std::vector<Facet>, 2> sides_;
  std::array<std::vector<Facet*>, 2> active_;
  std::vector<Shared> shared_;
  std::vector<LineEnd> line_ends_;
  std::vector<Polygon> left_;
  std::vector<int> signs_;
  Polygon common_, inner_, outer_;

  void take_equal(std::span<const std::uint32_t> on_plane);
  [[nodiscard]] bool are_equal(std::uint32_t a, std::uint32_t b) const;
  double find_boxes();
  void sweep(double slack);
  void meet(Facet& negative, Facet& positive);
  [[nodiscard]] Overlap overlap(std::span<const PolygonCorner> polygon,
                                std::span<const PolygonCorner> within);
  int side(std::uint32_t point, geometry::OrientedHyperplane plane, const geometry::Hyperplane<3>& rounded);
  [[nodiscard]] Crossing& place_of(std::uint64_t lines);
  std::uint32_t crossing(geometry::HyperplaneId a, geometry::HyperplaneId b);
  void cut(const Polygon& polygon, geometry::OrientedHyperplane by, Polygon& inner, Polygon& outer);
  [[nodiscard]] std::span<const PolygonCorner> corners_of(const PlanePiece& piece) const;
  [[nodiscard]] bool is_shared_out(const Facet& facet);
  void add_line_ends(std::span<const PolygonCorner> polygon, int way);
  [[nodiscard]] const geometry::Vertex<3>& vertex(std::uint32_t point) const;
  void sort_by_corners(std::vector<std::uint32_t>& pieces) const;
  void add_what_is_left(const Facet& facet);
  void subtract(std::span<const PolygonCorner> polygon);
  void add_rest(std::uint32_t source);
  void add_piece(std::int32_t negative, std::int32_t positive, std::span<const PolygonCorner> polygon);
};

}  // namespace bsp2::meshing
