#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::geometry {

/// Points of E^3, each with the hyperplanes that are known to meet there (ascending; at least its own three).
/// Vertices are canonical ones.
///
/// Most questions whether a point is on a plane are answered by what is known; only the others ask the
/// predicate.
struct PointSet {
  std::vector<Vertex<3>> vertices;
  std::vector<std::uint32_t> offset{0};
  std::vector<HyperplaneId> planes;

  [[nodiscard]] std::size_t size() const { return vertices.size(); }
  [[nodiscard]] std::span<const HyperplaneId> planes_of(std::size_t point) const {
    return {planes.data() + offset[point], offset[point + 1] - offset[point]};
  }
  [[nodiscard]] bool is_known_on(std::size_t point, HyperplaneId id) const {
    for (const HyperplaneId plane : planes_of(point))
      if (plane == id) return true;
    return false;
  }
  void clear();
  void add(const Vertex<3>& vertex, std::span<const HyperplaneId> known);
};

/// The vertex of three hyperplanes; the same bits in whatever order they are named.
Vertex<3> canonical_vertex(const HyperplaneTable<3>& table, std::array<HyperplaneId, 3> ids);

/// How far rounded coordinates are along a direction in which different points hardly ever agree.
double place_along(const std::array<double, 3>& x);

/// Exact coordinates of hyperplanes and vertices, those asked for last kept. A reference is valid until the
/// next call.
class ExactCoordinates {
 public:
  explicit ExactCoordinates(const HyperplaneTable<3>& table) : table_(table) {}
  const ExactCovector<3>& covector(HyperplaneId id);
  /// Homogeneous, the weight last; in the table's grid units.
  const ExactCovector<3>& point(const Vertex<3>& vertex);

 private:
  struct Covector {
    HyperplaneId id = ~HyperplaneId{0};
    ExactCovector<3> value;
  };
  struct Point {
    std::array<HyperplaneId, 3> ids{~HyperplaneId{0}, 0, 0};
    ExactCovector<3> value;
  };
  static constexpr std::size_t kept = 512;
  const HyperplaneTable<3>& table_;
  std::vector<Covector> covectors_;  // empty until the first is asked for: hardly any may be
  std::vector<Point> points_;
};

/// Questions about points, answered exactly. Thread rule: one thread at a time.
class ExactPoints {
 public:
  explicit ExactPoints(const HyperplaneTable<3>& table) : table_(table), coordinates_(table) {}

  [[nodiscard]] const HyperplaneTable<3>& table() const { return table_; }
  [[nodiscard]] ExactCoordinates& coordinates() { return coordinates_; }
  /// -1, 0, +1: the side of the hyperplane on which the point is.
  int side(const PointSet& points, std::size_t point, HyperplaneId id) {
    return side(points, point, id, table_.rounded(id));
  }
  /// The side of a point, for several that are held against one hyperplane.
  int side(const PointSet& points, std::size_t point, HyperplaneId id, const Hyperplane<3>& rounded);
  int side(const Vertex<3>& vertex, HyperplaneId id) { return side(vertex, id, table_.rounded(id)); }
  /// The predicate of Splitter::side, for one point that is held against several hyperplanes.
  int side(const Vertex<3>& vertex, HyperplaneId id, const Hyperplane<3>& rounded);

  /// Makes equal points one. Of its names the lowest one stays, so that the result depends on the set alone.
  /// @return the new index of each old point.
  std::vector<std::uint32_t> unify(PointSet& points);
  /// Makes equal points one and leaves them in their order: each in the place of the first that is equal.
  /// @param rank gets the place of each point in an order that, of any two, depends on these alone: by
  /// `place_along` of the coordinates that stay, then by these, then by name.
  std::vector<std::uint32_t> unify_in_order(PointSet& points, std::vector<std::uint32_t>& rank);

  /// Whether w is between u and v. @pre the three are different points of one line.
  bool is_between(const PointSet& points, std::uint32_t u, std::uint32_t w, std::uint32_t v);
  /// -1, 0, +1: how two points compare along an axis.
  int compare(const PointSet& points, std::uint32_t a, std::uint32_t b, int axis);
  /// An axis along which different points of the line through a and b differ, or -1 where the rounded points
  /// do not tell.
  static int axis_of_line(const PointSet& points, std::uint32_t a, std::uint32_t b);
  /// Whether a comes before b on the way to v. @pre the three are different points of one line.
  bool is_before(const PointSet& points, std::uint32_t a, std::uint32_t b, std::uint32_t v);

 private:
  const HyperplaneTable<3>& table_;
  ExactCoordinates coordinates_;
  struct Cluster {
    std::uint32_t point;  // named lowest
    std::uint32_t known;  // head of a list in known_; none: what its only member knows
    double key;
  };
  struct Known {
    HyperplaneId plane;
    std::uint32_t next;
  };
  std::vector<std::pair<double, std::uint32_t>> keys_;
  std::vector<Cluster> clusters_;
  std::vector<Known> known_;
  PointSet united_;  // keeps its memory from one call to the next

  int exact_side(const Vertex<3>& vertex, HyperplaneId id);
  void sort_keys(const PointSet& points);
  std::vector<std::uint32_t> find_clusters(const PointSet& points);
  std::vector<std::uint32_t> order_clusters(const PointSet& points);
  bool equals(const PointSet& points, std::uint32_t point, const Cluster& cluster);
  bool is_known(std::uint32_t list, HyperplaneId plane) const;
  void merge(const PointSet& points, std::uint32_t point, Cluster& cluster);
  void add_united(const PointSet& points, const Cluster& cluster);
};

/// A plane in which points are seen from the side of its outward normal, in two of their coordinates.
class PlaneFrame {
 public:
  PlaneFrame(ExactPoints& exact, OrientedHyperplane outward);

  [[nodiscard]] HyperplaneId plane() const { return plane_; }
  /// Sign of the area of a triangle of points of the plane: 1 = counter-clockwise seen from outside. Exact.
  [[nodiscard]] int orientation(const Vertex<3>& a, const Vertex<3>& b, const Vertex<3>& c) const;
  /// A total order of the plane's points, along a direction that hardly any model has. Exact; `a` and `b`
  /// differ.
  [[nodiscard]] bool is_left_of(const Vertex<3>& a, const Vertex<3>& b) const;

 private:
  ExactCoordinates& coordinates_;
  HyperplaneId plane_;
  int u_, v_;
};

}  // namespace bsp2::geometry
