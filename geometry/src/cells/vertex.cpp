// The vertices in which hyperplanes meet. Compiled without contracted additions: a vertex is the same bit for
// bit on all processors.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/exact/exact.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "support/vector_lanes.hpp"

namespace bsp2::geometry {
namespace {

/// @param point in homogeneous coordinates, in the table's grid units.
template <int D, typename Integer>
Vertex<D> rounded_vertex(const HyperplaneTable<D>& table, const std::array<HyperplaneId, D>& ids,
                         const std::array<Integer, D + 1>& point) {
  Vertex<D> vertex{{}, 8 * D * 0x1p-53 * table.radius(), ids};
  const auto top = static_cast<long>(mp::msb(Integer(mp::abs(point[D]))));
  const double weight = scaled_to_double(point[D], top);
  for (int i = 0; i < D; ++i) vertex.x[i] = scaled_to_double(point[i], top - table.grid_exponent()) / weight;
  return vertex;
}

/// The primitive that all of these hyperplanes are of, as those of a finely faceted surface: the map that
/// places it.
template <int D>
std::optional<std::uint32_t> common_map(const HyperplaneTable<D>& table,
                                        const std::array<HyperplaneId, D>& ids) {
  const auto* first = table.source(ids[0]);
  for (const HyperplaneId id : ids) {
    const auto* source = table.source(id);
    if (source == nullptr || source->map != first->map) return std::nullopt;
  }
  return first->map;
}

/// Hyperplanes of one primitive meet in its own frame, where the numbers are a third as long, and its map
/// takes the point to the model.
template <int D>
Vertex<D> exact_vertex(const HyperplaneTable<D>& table, const std::array<HyperplaneId, D>& ids) {
  if (const auto map = common_map<D>(table, ids)) {
    using Integer =
        FixedInteger<896>;  // minors of D rows of 216 bits, or 114 above D = 3, times entries of 122
    std::array<std::array<Integer, D + 1>, D> rows;
    for (int i = 0; i < D; ++i) {
      const auto& covector = table.covector(table.source(ids[i])->covector).exact;
      for (int j = 0; j <= D; ++j) rows[i][j] = Integer(covector[j]);
    }
    return rounded_vertex<D>(table, ids, table.map(*map).image(meeting_point<D>(rows)));
  }
  std::array<ExactCovector<D>, D> rows;
  for (int i = 0; i < D; ++i) rows[i] = table.exact(ids[i]);
  return rounded_vertex<D>(table, ids, meeting_point<D>(rows));
}

/// The rounded meeting point and its error bound.
///
/// With the approximate inverse M of the normals N and the point x = -M d: the exact point differs from x by
/// N^-1 r, r the exact values of the hyperplanes at x, |r_i| <= |h_i(x)| + error_i, and |N^-1| <= |M| / (1 -
/// |I - M N|).
template <int D>
bool solve_by_elimination(const std::array<Hyperplane<D>, D>& h, Vertex<D>& vertex) {
  std::array<std::array<double, 2 * D>, D> a{};  // [N | I], reduced to [I | M] with pivoting
  for (int i = 0; i < D; ++i) {
    for (int j = 0; j < D; ++j) a[i][j] = h[i].normal[j];
    a[i][D + i] = 1;
  }
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    for (int i = k + 1; i < D; ++i)
      if (std::fabs(a[i][k]) > std::fabs(a[pivot][k])) pivot = i;
    if (std::fabs(a[pivot][k]) < 0x1p-30) return false;
    std::swap(a[k], a[pivot]);
    const double inverse = 1 / a[k][k];
    for (double& entry : a[k]) entry *= inverse;
    for (int i = 0; i < D; ++i)
      if (i != k && a[i][k] != 0) {
        const double factor = a[i][k];
        for (int j = 0; j < 2 * D; ++j) a[i][j] -= factor * a[k][j];
      }
  }
  double defect = 0, norm = 0;
  for (int i = 0; i < D; ++i) {
    vertex.x[i] = 0;
    for (int j = 0; j < D; ++j) {
      double product = i == j ? -1 : 0;
      for (int k = 0; k < D; ++k) product += a[i][D + k] * h[k].normal[j];
      defect += product * product;
      norm += a[i][D + j] * a[i][D + j];
      vertex.x[i] -= a[i][D + j] * h[j].offset;
    }
  }
  norm = std::sqrt(norm);
  defect = std::sqrt(defect) + norm * D * 0x1p-50;  // and the rounding of N itself
  if (!(defect < 0.25)) return false;
  double residual = 0;
  for (int i = 0; i < D; ++i) residual += std::fabs(h[i].at(vertex.x)) + h[i].error;
  vertex.error = norm * residual * 1.5;
  return true;
}

/// In space: one hyperplane, or one a lane.
template <typename Number>
struct Planes {
  std::array<Number, 3> normal;
  Number offset, error;
};

/// Where three of them meet, by how much that is off at most, and the size of their determinant: below
/// `least_size` neither is known.
template <typename Number>
struct Meetings {
  std::array<Number, 3> x;
  Number error, size;
};
constexpr double least_size = 0x1p-24;

[[gnu::always_inline]] inline void make_positive(double& value) { value = std::fabs(value); }
[[gnu::always_inline]] inline void make_positive(long double& value) { value = std::fabs(value); }
[[gnu::always_inline]] inline void make_positive(Lanes& values) {
  Bits bits;
  std::memcpy(&bits, &values, sizeof bits);
  bits &= ~std::uint64_t{0} >> 1;
  std::memcpy(&values, &bits, sizeof bits);
}

template <typename Number>
[[gnu::always_inline]] inline void find_cross_product(const Planes<Number>& u, const Planes<Number>& v,
                                                      std::array<Number, 3>& product) {
  product[0] = u.normal[1] * v.normal[2] - u.normal[2] * v.normal[1];
  product[1] = u.normal[2] * v.normal[0] - u.normal[0] * v.normal[2];
  product[2] = u.normal[0] * v.normal[1] - u.normal[1] * v.normal[0];
}

/// The bound of how far x is from a hyperplane, times a bound of the length of a cross product.
template <typename Number>
[[gnu::always_inline]] inline void find_residual(const Planes<Number>& h, const std::array<Number, 3>& x,
                                                 const std::array<Number, 3>& product, Number& residual) {
  Number value = h.offset + h.normal[0] * x[0] + h.normal[1] * x[1] + h.normal[2] * x[2];
  std::array<Number, 3> sizes = product;
  make_positive(value);
  for (Number& size : sizes) make_positive(size);
  residual = (value + h.error) * (sizes[0] + sizes[1] + sizes[2]);
}

/// By Cramer's rule: the rows of N^-1 are cross products over the determinant. (Vectors as results would be a
/// matter of the binary interface.)
template <typename Number>
[[gnu::always_inline]] inline void meet(const Planes<Number>& a, const Planes<Number>& b,
                                        const Planes<Number>& c, Meetings<Number>& at) {
  std::array<Number, 3> bc, ca, ab;
  find_cross_product(b, c, bc);
  find_cross_product(c, a, ca);
  find_cross_product(a, b, ab);
  const Number determinant = a.normal[0] * bc[0] + a.normal[1] * bc[1] + a.normal[2] * bc[2];
  const Number inverse = -1 / determinant;
  for (int i = 0; i < 3; ++i) at.x[i] = (a.offset * bc[i] + b.offset * ca[i] + c.offset * ab[i]) * inverse;
  Number of_a, of_b, of_c;
  find_residual(a, at.x, bc, of_a);
  find_residual(b, at.x, ca, of_b);
  find_residual(c, at.x, ab, of_c);
  at.size = determinant;
  make_positive(at.size);
  // Cross products and the determinant are off by less than 2^-49, and size >= 2^-24: their relative errors
  // are far below 2^-20, and lengths of nearly parallel normals by less than 2^-49 each, which the second
  // term covers.
  at.error = ((of_a + of_b + of_c) * (1 + 0x1p-20) + (a.error + b.error + c.error) * 0x1p-20) / at.size;
}

// Not by adding zeros, which would take the sign of one away.
[[gnu::always_inline]] inline void spread(double value, double& number) { number = value; }
[[gnu::always_inline]] inline void spread(double value, Lanes& lanes) {
  lanes = Lanes{value, value, value, value};
}

template <typename Number>
[[gnu::always_inline]] inline void spread(const Hyperplane<3>& h, Planes<Number>& planes) {
  for (int i = 0; i < 3; ++i) spread(h.normal[i], planes.normal[i]);
  spread(h.offset, planes.offset);
  spread(h.error, planes.error);
}

bool solve_by_cross_products(const std::array<Hyperplane<3>, 3>& h, Vertex<3>& vertex) {
  std::array<Planes<double>, 3> planes;
  for (int i = 0; i < 3; ++i) spread(h[i], planes[i]);
  Meetings<double> at;
  meet(planes[0], planes[1], planes[2], at);
  vertex.x = at.x;
  vertex.error = at.error;
  return at.size >= least_size;
}

/// Planes in long double. Where one vertex needs them, others of the same cut do, which share planes with it:
/// some are kept.
template <std::size_t kept = 16>
class RefinedPlanes {
 public:
  explicit RefinedPlanes(const HyperplaneTable<3>& table) : table_(table) {}
  [[nodiscard]] const HyperplaneTable<3>& table() const { return table_; }
  /// @return whether the plane can be refined.
  bool find(HyperplaneId id, Planes<long double>& planes) {
    Entry& entry = entries_[id % kept];
    if (entry.id != id) {
      const auto refined = table_.refined(id, last_);
      if (!refined) return false;
      entry = {id, {refined->normal, refined->offset, refined->error}};
    }
    planes = entry.planes;
    return true;
  }

 private:
  struct Entry {
    HyperplaneId id = ~HyperplaneId{0};
    Planes<long double> planes{};
  };
  const HyperplaneTable<3>& table_;
  HyperplaneTable<3>::LastMap last_;
  std::array<Entry, kept> entries_;
};

/// In long double, in which cross products and the determinant are off by less than 2^-60: for planes that
/// are nearly parallel.
template <typename Refined>
bool solve_by_refined_planes(Refined& refined, const std::array<HyperplaneId, 3>& ids, Vertex<3>& vertex) {
  constexpr long double least_size_refined = 0x1p-34L;
  const double radius = refined.table().radius();
  std::array<Planes<long double>, 3> planes;
  for (int i = 0; i < 3; ++i)
    if (!refined.find(ids[i], planes[i])) return false;
  Meetings<long double> at;
  meet(planes[0], planes[1], planes[2], at);
  for (int i = 0; i < 3; ++i) vertex.x[i] = static_cast<double>(at.x[i]);
  vertex.error = static_cast<double>(at.error) * (1 + 0x1p-50) + 4 * 0x1p-53 * radius;
  vertex.hyperplanes = ids;
  return at.size >= least_size_refined && vertex.error < largest_vertex_error * radius;
}

/// Where doubles do not tell well enough.
template <typename Refined>
Vertex<3> careful_vertex(Refined& refined, const std::array<HyperplaneId, 3>& ids,
                         std::uint64_t& exact_evaluations) {
  Vertex<3> vertex;
  if (solve_by_refined_planes(refined, ids, vertex)) return vertex;
  ++exact_evaluations;
  return exact_vertex<3>(refined.table(), ids);
}

constexpr std::size_t lanes = sizeof(Lanes) / sizeof(double);

/// One hyperplane a lane.
[[gnu::always_inline]] inline void load(const std::array<const Hyperplane<3>*, lanes>& hyperplanes,
                                        Planes<Lanes>& planes) {
  static_assert(offsetof(Hyperplane<3>, offset) == offsetof(Hyperplane<3>, normal) + 3 * sizeof(double));
  std::array<Lanes, 4> rows;
  for (std::size_t lane = 0; lane < lanes; ++lane) std::memcpy(&rows[lane], hyperplanes[lane], sizeof(Lanes));
  transpose(rows);
  std::copy_n(rows.begin(), 3, planes.normal.begin());
  planes.offset = rows[3];
  planes.error =
      Lanes{hyperplanes[0]->error, hyperplanes[1]->error, hyperplanes[2]->error, hyperplanes[3]->error};
}

/// Coordinates and error of one vertex a lane.
[[gnu::always_inline]] inline void store(const Meetings<Lanes>& at, std::span<Vertex<3>> vertices) {
  static_assert(offsetof(Vertex<3>, error) == offsetof(Vertex<3>, x) + 3 * sizeof(double));
  std::array<Lanes, 4> rows{at.x[0], at.x[1], at.x[2], at.error};
  transpose(rows);
  for (std::size_t lane = 0; lane < vertices.size(); ++lane)
    std::memcpy(&vertices[lane], &rows[lane], sizeof(Lanes));
}

}  // namespace

template <int D>
Vertex<D> make_vertex(const HyperplaneTable<D>& table, const std::array<HyperplaneId, D>& ids,
                      std::uint64_t& exact_evaluations) {
  std::array<Hyperplane<D>, D> h;
  for (int i = 0; i < D; ++i) h[i] = table.rounded(ids[i]);
  Vertex<D> vertex;
  vertex.hyperplanes = ids;
  bool solved;
  if constexpr (D == 3)
    solved = solve_by_cross_products(h, vertex);
  else
    solved = solve_by_elimination<D>(h, vertex);
  if (solved && vertex.error < largest_vertex_error * table.radius()) return vertex;
  if constexpr (D == 3) {
    RefinedPlanes<> refined(table);
    return careful_vertex(refined, ids, exact_evaluations);
  }
  ++exact_evaluations;
  return exact_vertex<D>(table, ids);
}

std::vector<Vertex<3>> make_vertices(const HyperplaneTable<3>& table,
                                     std::span<const std::array<HyperplaneId, 3>> names) {
  constexpr std::size_t kept = 4096;
  const auto refined = std::make_unique<RefinedPlanes<kept>>(table);
  std::uint64_t unused = 0;
  std::vector<Vertex<3>> vertices;
  vertices.reserve(names.size());
  for (const auto& ids : names) {
    Vertex<3> vertex;
    vertex.hyperplanes = ids;
    const std::array<Hyperplane<3>, 3> h{table.rounded(ids[0]), table.rounded(ids[1]), table.rounded(ids[2])};
    const bool solved = solve_by_cross_products(h, vertex);
    if (!solved || !(vertex.error < largest_vertex_error * table.radius()))
      vertex = careful_vertex(*refined, ids, unused);
    vertices.push_back(vertex);
  }
  return vertices;
}

namespace {

/// In space, as many at a time as there are lanes.
BSP2_VECTOR_CLONES void make_vertices_in_space(const HyperplaneTable<3>& table,
                                               std::span<const EdgeHyperplanes<3>> edges, HyperplaneId id,
                                               Vertex<3>* vertices, std::uint64_t& exact_evaluations) {
  const double largest_error = largest_vertex_error * table.radius();
  const std::span<const Hyperplane<3>> of_primitives = table.rounded();
  Planes<Lanes> common{}, first{}, second{};
  spread(table.rounded(id), common);
  std::array<std::array<Hyperplane<3>, lanes>, 2> computed;  // of those that are not the primitives' own
  std::optional<RefinedPlanes<>> refined;                    // few cuts need them
  for (std::size_t done = 0; done < edges.size(); done += lanes) {
    const std::size_t count = std::min(lanes, edges.size() - done);
    std::array<std::array<const Hyperplane<3>*, lanes>, 2> pairs;
    for (std::size_t lane = 0; lane < lanes; ++lane)
      for (std::size_t i = 0; i < 2; ++i) {
        const HyperplaneId own = edges[done + std::min(lane, count - 1)][i];
        pairs[i][lane] =
            own < of_primitives.size() ? &of_primitives[own] : &(computed[i][lane] = table.rounded(own));
      }
    load(pairs[0], first);
    load(pairs[1], second);
    Meetings<Lanes> at;
    meet(first, second, common, at);
    store(at, {vertices + done, count});
    for (std::size_t lane = 0; lane < count; ++lane) {
      Vertex<3>& vertex = vertices[done + lane];
      vertex.hyperplanes = {edges[done + lane][0], edges[done + lane][1], id};
      if (at.size[lane] >= least_size && vertex.error < largest_error) continue;
      if (!refined) refined.emplace(table);
      vertex = careful_vertex(*refined, vertex.hyperplanes, exact_evaluations);
    }
  }
}

}  // namespace

template <int D>
void make_vertices(const HyperplaneTable<D>& table, std::span<const EdgeHyperplanes<D>> edges,
                   HyperplaneId id, Vertex<D>* vertices, std::uint64_t& exact_evaluations) {
  if constexpr (D == 3) {
    make_vertices_in_space(table, edges, id, vertices, exact_evaluations);
  } else {
    for (const EdgeHyperplanes<D>& edge : edges) {
      std::array<HyperplaneId, D> ids;
      *std::copy(edge.begin(), edge.end(), ids.begin()) = id;
      *vertices++ = make_vertex<D>(table, ids, exact_evaluations);
    }
  }
}

#define BSP2_INSTANTIATE(D)                                                                        \
  template Vertex<D> make_vertex<D>(const HyperplaneTable<D>&, const std::array<HyperplaneId, D>&, \
                                    std::uint64_t&);                                               \
  template void make_vertices<D>(const HyperplaneTable<D>&, std::span<const EdgeHyperplanes<D>>,   \
                                 HyperplaneId, Vertex<D>*, std::uint64_t&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
