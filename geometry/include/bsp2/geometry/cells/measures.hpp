#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::geometry {

/// Integrals of x_i x_j over a set, with x_0 = 1: volume, first and second moments; the paper's 4 x 4 inertia
/// tensor.
///
/// Symmetric, stored by rows of the upper triangle: (0,0), (0,1) ... (0,D), (1,1) ... In model units, about
/// the origin.
template <int D>
struct Moments {
  static constexpr int size = (D + 1) * (D + 2) / 2;
  std::array<double, size> integral{};
  [[nodiscard]] double volume() const { return integral[0]; }
  static constexpr int index(int i, int j) {
    return i <= j ? i * (2 * (D + 1) - i - 1) / 2 + j : index(j, i);
  }
};

/// Sums moments so that the result depends neither on the order of the summands nor on their grouping: each
/// is rounded to a multiple of 2^-96 of what the root cell's own moment may be, and added as an integer.
/// Thread rule: one thread at a time; sums of several threads are merged by `+=`.
template <int D>
class MomentSum {
 public:
  /// @param radius a bound of |x_i| over all that will be added.
  /// @param width a bound of its extent along each axis; small for a small model far from the origin.
  MomentSum(double radius, double width);
  explicit MomentSum(double radius = 1) : MomentSum(radius, 2 * radius) {}
  void add(const Moments<D>& moments);
  MomentSum& operator+=(const MomentSum& other);
  [[nodiscard]] Moments<D> value() const;

  /// The sum as plain words, to be sent or stored: two for each integer, the low one first.
  struct State {
    std::array<std::int32_t, 3> exponent;
    std::array<std::uint64_t, 2 * Moments<D>::size> words;
    friend bool operator==(const State&, const State&) = default;
  };
  [[nodiscard]] State state() const;
  void set_state(const State& state);

 private:
  std::array<int, 3> exponent_;  // of one unit of moments of degree 0, 1, 2
  std::array<Int128, Moments<D>::size> sum_{};
  [[nodiscard]] static int degree(int index);
};

/// Corners, by their places among a cell's vertices.
using Triangle = std::array<std::uint16_t, 3>;

/// Flattens cells and measures them. Thread rule: one thread at a time.
/// Cells are cut into simplices from their first vertex, facet by facet (so no term is negative).
template <int D>
class CellWriter {
 public:
  explicit CellWriter(const HyperplaneTable<D>& table) : table_(&table) {}
  /// Volume and moments of a cell.
  Moments<D> measure(const Cell<D>& cell);
  /// Appends the cell with its geometry and volume; the caller fills label, primitive, part, region and
  /// level.
  /// @return its moments.
  Moments<D> append(const Cell<D>& cell, CellBatch& batch);

 private:
  const HyperplaneTable<D>* table_;
  std::vector<std::uint16_t> neighbours_;  // of each vertex along the facet at hand: both, by exclusive or
  std::vector<std::uint16_t> loops_;       // ordered vertices of all facets (D = 3)
  std::vector<std::uint32_t> loop_ends_;
  std::vector<std::uint16_t> doubtful_;                 // facets too thin to tell which way round they are
  std::vector<std::array<double, 3>> seen_from_first_;  // the vertices, seen from the first one (D = 3)
  std::vector<Triangle>
      triangles_;  // of the facets that miss the first vertex; there may be more memory than triangles
  std::size_t triangle_count_ = 0;

  void cut_into_triangles(const Cell<D>& cell);
  void order_facets(const Cell<D>& cell);
  void turn_doubtful_facets();
};

}  // namespace bsp2::geometry
