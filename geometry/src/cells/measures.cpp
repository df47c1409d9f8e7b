#include "bsp2/geometry/cells/measures.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"
#include "support/vector_lanes.hpp"

namespace bsp2::geometry {
namespace {

/// Adds the moments of a simplex with D + 1 corners and the determinant D! times its content. All are left
/// undivided, for finish(): of corners that are small integers they are exact, so that a cube of side 10 has
/// the volume 1000. Source: Strang and Fix; integral of x_i x_j = V / ((D+1)(D+2)) (sum_k v_ki v_kj + sum_k
/// v_ki sum_k v_kj).
template <int D>
void add_simplex(const std::array<const double*, D + 1>& corners, double determinant, Moments<D>& moments) {
  std::array<double, D> sum{};
  for (const double* corner : corners)
    for (int i = 0; i < D; ++i) sum[i] += corner[i];
  moments.integral[0] += determinant;
  for (int i = 0; i < D; ++i) {
    moments.integral[Moments<D>::index(0, i + 1)] += determinant * sum[i];
    for (int j = i; j < D; ++j) {
      double products = sum[i] * sum[j];
      for (const double* corner : corners) products += corner[i] * corner[j];
      moments.integral[Moments<D>::index(i + 1, j + 1)] += determinant * products;
    }
  }
}

constexpr double factorial(int n) { return n <= 1 ? 1 : n * factorial(n - 1); }

/// Divides what add_simplex() has summed up: by D!, (D + 1)! and (D + 2)!.
template <int D>
void finish(Moments<D>& moments) {
  for (int i = 0; i <= D; ++i)
    for (int j = i; j <= D; ++j)
      moments.integral[Moments<D>::index(i, j)] /= factorial(D + (i > 0 ? 1 : 0) + (j > 0 ? 1 : 0));
}

constexpr std::size_t lanes = 4;

/// What add_simplex() would add for the tetrahedra between the origin and each triangle, in four sums. @param
/// triangles a multiple of four.
BSP2_VECTOR_CLONES void add_tetrahedra(const std::array<double, 3>* points,
                                       std::span<const Triangle> triangles, Moments<3>& moments) {
  std::array<Lanes, Moments<3>::size> sums{};
  for (std::size_t at = 0; at < triangles.size(); at += lanes) {
    std::array<std::array<Lanes, 3>, 3> corners;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto &p = points[triangles[at][corner]], &q = points[triangles[at + 1][corner]];
      const auto &r = points[triangles[at + 2][corner]], &s = points[triangles[at + 3][corner]];
      for (std::size_t i = 0; i < 3; ++i) corners[corner][i] = Lanes{p[i], q[i], r[i], s[i]};
    }
    const auto& [a, b, c] = corners;
    const Lanes product = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                          a[2] * (b[0] * c[1] - b[1] * c[0]);
    const Lanes determinant = product < 0 ? -product : product;
    sums[0] += determinant;
    const std::array<Lanes, 3> sum{a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]};
#pragma GCC unroll 3  // so that all sums stay in registers
    for (int i = 0; i < 3; ++i) {
      sums[Moments<3>::index(0, i + 1)] += determinant * sum[i];
#pragma GCC unroll 3
      for (int j = i; j < 3; ++j)
        sums[Moments<3>::index(i + 1, j + 1)] +=
            determinant * (sum[i] * sum[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]);
    }
  }
#pragma GCC unroll 10
  for (int k = 0; k < Moments<3>::size; ++k)
    moments.integral[k] += (sums[k][0] + sums[k][1]) + (sums[k][2] + sums[k][3]);
}

/// From moments about `origin` to those about the origin of the coordinates, both undivided.
template <int D>
void move_undivided(const std::array<double, D>& origin, Moments<D>& moments) {
  const auto before = moments.integral;
  constexpr double first = D + 1, second = D + 2;  // what the divisors of the degrees differ by
  for (int i = 0; i < D; ++i) {
    const double first_i = before[Moments<D>::index(0, i + 1)];
    moments.integral[Moments<D>::index(0, i + 1)] += first * origin[i] * before[0];
    for (int j = i; j < D; ++j) {
      const double first_j = before[Moments<D>::index(0, j + 1)];
      moments.integral[Moments<D>::index(i + 1, j + 1)] +=
          second * (origin[i] * first_j + origin[j] * first_i + first * origin[i] * origin[j] * before[0]);
    }
  }
}

/// D! times the content.
template <int D>
double determinant_of(const std::array<const double*, D + 1>& corners) {
  std::array<std::array<double, D>, D> a;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) a[i][j] = corners[i + 1][j] - corners[0][j];
  double determinant = 1;
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    for (int i = k + 1; i < D; ++i)
      if (std::fabs(a[i][k]) > std::fabs(a[pivot][k])) pivot = i;
    if (a[pivot][k] == 0) return 0;
    std::swap(a[k], a[pivot]);
    determinant *= a[k][k];
    for (int i = k + 1; i < D; ++i)
      for (int j = k + 1; j < D; ++j) a[i][j] -= a[i][k] / a[k][k] * a[k][j];
  }
  return std::fabs(determinant);
}

/// Vertices of each face, by level, for cutting a cell of any dimension into simplices: a k-face is the cone
/// from its lowest vertex over those of its (k-1)-faces that miss it.
template <int D>
class SimplexCutter {
 public:
  SimplexCutter(const Cell<D>& cell, Moments<D>& moments) : cell_(cell), moments_(moments) {
    for (int k = 1; k < D; ++k) {
      lowest_[k].resize(cell.face_count(k));
      for (std::size_t face = 0; face < cell.face_count(k); ++face) {
        std::uint16_t low = 0xffff;
        for (const std::uint16_t sub : cell.subfaces(k, face))
          low = std::min(low, k == 1 ? sub : lowest_[k - 1][sub]);
        lowest_[k][face] = low;
      }
    }
  }
  void run() {
    corners_[0] = cell_.vertices()[0].x.data();
    if constexpr (D == 1) {
      corners_[1] = cell_.vertices()[1].x.data();
      add_simplex<1>(corners_, determinant_of<1>(corners_), moments_);
    } else {
      for (std::size_t facet = 0; facet < cell_.facet_count(); ++facet)
        if (!contains(D - 1, facet, 0)) cut(D - 1, facet);
    }
  }

 private:
  const Cell<D>& cell_;
  Moments<D>& moments_;
  std::array<std::vector<std::uint16_t>, D> lowest_;
  std::array<const double*, D + 1> corners_{};

  [[nodiscard]] bool contains(int k, std::size_t face, std::uint16_t vertex) const {
    if (k == 0) return face == vertex;
    const auto subfaces = cell_.subfaces(k, face);
    return std::any_of(subfaces.begin(), subfaces.end(),
                       [&](std::uint16_t sub) { return contains(k - 1, sub, vertex); });
  }
  void cut(int k, std::size_t face) {
    if (k == 0) {
      corners_[D] = cell_.vertices()[face].x.data();
      add_simplex<D>(corners_, determinant_of<D>(corners_), moments_);
      return;
    }
    const std::uint16_t apex = lowest_[k][face];
    corners_[D - k] = cell_.vertices()[apex].x.data();
    for (const std::uint16_t sub : cell_.subfaces(k, face))
      if (k == 1 ? sub != apex : !contains(k - 1, sub, apex)) cut(k - 1, sub);
  }
};

}  // namespace

template <int D>
MomentSum<D>::MomentSum(double radius, double width) {
  int r = 0, w = 0;
  std::frexp(radius, &r);
  std::frexp(width, &w);
  for (int k = 0; k < 3; ++k) exponent_[k] = w * D + r * k - 96;
}

template <int D>
int MomentSum<D>::degree(int index) {
  return index == 0 ? 0 : index <= D ? 1 : 2;
}

namespace {

/// Of a number in its bits: mantissa * 2^(exponent - 1023 - 52). From the bits: the library's ways are calls.
constexpr int fraction = 52, bias = 1023;
constexpr std::uint64_t leading = std::uint64_t{1} << fraction;

/// What on_grid() does with all other numbers.
[[gnu::noinline]] Int128 on_grid_by_cases(double value, int exponent) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  if (bits << 1 == 0) return 0;
  const int field = static_cast<int>(bits >> fraction & 0x7ff);  // 0: below 2^-1022, without a leading bit
  const int shift = std::max(field, 1) - bias - fraction - exponent;
  const std::uint64_t mantissa = (bits & (leading - 1)) | (field == 0 ? 0 : leading);
  if (field == 0x7ff || shift + static_cast<int>(std::bit_width(mantissa)) > 126)
    throw std::logic_error("a moment exceeds what the root cell's may be");
  if (shift < -fraction - 1) return 0;  // below a half
  Int128 size = 0;
  if (shift >= 0) {
    size = static_cast<Int128>(mantissa) << shift;
  } else {
    const std::uint64_t whole = mantissa >> -shift, rest = mantissa << (64 + shift),
                        half = std::uint64_t{1} << 63;
    size = static_cast<Int128>(whole + (rest > half || (rest == half && whole % 2 != 0) ? 1 : 0));
  }
  return bits >> 63 != 0 ? -size : size;
}

/// value * 2^-exponent rounded to the nearest integer, halves to the even one.
[[gnu::always_inline]] inline Int128 on_grid(double value, int exponent) {
  constexpr int widest = 126 - fraction - 1;
  const auto bits = std::bit_cast<std::uint64_t>(value);
  const int field = static_cast<int>(bits >> fraction & 0x7ff), shift = field - bias - fraction - exponent;
  if (field == 0 || field == 0x7ff || shift < 0 || shift > widest) return on_grid_by_cases(value, exponent);
  const Int128 size = static_cast<Int128>((bits & (leading - 1)) | leading) << shift;
  const Int128 sign = -static_cast<Int128>(bits >> 63);  // 0, or all bits
  return (size ^ sign) - sign;
}

}  // namespace

template <int D>
void MomentSum<D>::add(const Moments<D>& moments) {
  for (int i = 0; i < Moments<D>::size; ++i) sum_[i] += on_grid(moments.integral[i], exponent_[degree(i)]);
}

template <int D>
MomentSum<D>& MomentSum<D>::operator+=(const MomentSum& other) {
  for (int i = 0; i < Moments<D>::size; ++i) sum_[i] += other.sum_[i];
  return *this;
}

template <int D>
Moments<D> MomentSum<D>::value() const {
  Moments<D> result;
  for (int i = 0; i < Moments<D>::size; ++i)
    result.integral[i] = std::ldexp(static_cast<double>(sum_[i]), exponent_[degree(i)]);
  return result;
}

template <int D>
typename MomentSum<D>::State MomentSum<D>::state() const {
  State state{};
  std::copy(exponent_.begin(), exponent_.end(), state.exponent.begin());
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    state.words[2 * i] = static_cast<std::uint64_t>(sum_[i]);
    state.words[2 * i + 1] = static_cast<std::uint64_t>(sum_[i] >> 64);
  }
  return state;
}

template <int D>
void MomentSum<D>::set_state(const State& state) {
  std::copy(state.exponent.begin(), state.exponent.end(), exponent_.begin());
  for (std::size_t i = 0; i < sum_.size(); ++i)
    sum_[i] = static_cast<Int128>(static_cast<std::uint64_t>(state.words[2 * i + 1])) << 64 |
              static_cast<Int128>(state.words[2 * i]);
}

/// Puts the vertices of each facet in order around it, counter-clockwise seen from outside.
template <int D>
void CellWriter<D>::order_facets(const Cell<D>& cell) {
  if constexpr (D == 3) {
    const auto vertices = cell.vertices();
    loops_.clear();
    loop_ends_.clear();
    doubtful_.clear();
    neighbours_.assign(vertices.size(), 0);
    std::uint16_t* const neighbours = neighbours_.data();
    const std::uint16_t* const ends = cell.subfaces(1, 0).data();  // two of each edge
    for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
      const auto edges = cell.subfaces(2, facet);
      for (const std::uint16_t edge : edges) {
        const std::uint16_t a = ends[2 * edge], b = ends[2 * edge + 1];
        neighbours[a] ^= b;
        neighbours[b] ^= a;
      }
      const std::size_t begin = loops_.size();
      loops_.resize(begin + edges.size());
      std::uint16_t previous = ends[2 * edges[0]], at = ends[2 * edges[0] + 1];
      loops_[begin] = previous;
      for (std::size_t i = begin + 1; i < loops_.size(); ++i) {
        loops_[i] = at;
        const auto next = static_cast<std::uint16_t>(neighbours[at] ^ previous);
        neighbours[at] = 0;
        previous = std::exchange(at, next);
      }
      neighbours[loops_[begin]] = 0;
      // Newell's normal against the outward normal.
      const OrientedHyperplane code = cell.facet_hyperplane(facet);
      const auto normal = table_->rounded(code.id()).normal;
      const auto& o = vertices[loops_[begin]].x;
      double turn = 0, length = 0, error = vertices[loops_[begin]].error, bound = 0;
      // Each triangle of a convex facet turns the same way: the first that is thick enough tells.
      for (std::size_t i = begin + 1; i + 1 < loops_.size() && std::fabs(turn) <= bound; ++i) {
        const auto &p = vertices[loops_[i]].x, &q = vertices[loops_[i + 1]].x;
        const double ux = p[0] - o[0], uy = p[1] - o[1], uz = p[2] - o[2], vx = q[0] - o[0], vy = q[1] - o[1],
                     vz = q[2] - o[2];
        turn += normal[0] * (uy * vz - uz * vy) + normal[1] * (uz * vx - ux * vz) +
                normal[2] * (ux * vy - uy * vx);
        length +=
            std::fabs(ux) + std::fabs(uy) + std::fabs(uz) + std::fabs(vx) + std::fabs(vy) + std::fabs(vz);
        error = std::max({error, vertices[loops_[i]].error, vertices[loops_[i + 1]].error});
        bound = 4 * error * (length + error * static_cast<double>(edges.size())) + 0x1p-48 * length * length;
      }
      if ((turn < 0) != code.flipped())
        std::reverse(loops_.begin() + static_cast<std::ptrdiff_t>(begin), loops_.end());
      loop_ends_.push_back(static_cast<std::uint32_t>(loops_.size()));
      if (std::fabs(turn) <= bound) doubtful_.push_back(static_cast<std::uint16_t>(facet));
    }
    if (!doubtful_.empty()) turn_doubtful_facets();
  }
}

/// A facet whose rounded coordinates do not tell how it turns, because it is as thin as they are rounded,
/// turns as its neighbours say: they run along the common edge in the opposite direction.
template <int D>
void CellWriter<D>::turn_doubtful_facets() {
  const auto begin_of = [&](std::size_t facet) {
    return facet == 0 ? std::size_t{0} : loop_ends_[facet - 1];
  };
  const auto runs_along = [&](std::size_t facet, std::uint16_t from, std::uint16_t to) {
    const std::size_t begin = begin_of(facet), end = loop_ends_[facet];
    for (std::size_t i = begin; i < end; ++i)
      if (loops_[i] == from && loops_[i + 1 < end ? i + 1 : begin] == to) return true;
    return false;
  };
  const auto is_doubtful = [&](std::size_t facet) {
    return std::find(doubtful_.begin(), doubtful_.end(), facet) != doubtful_.end();
  };
  if (doubtful_.size() == loop_ends_.size()) doubtful_.pop_back();  // all of them: as one of them says
  while (!doubtful_.empty()) {
    const std::size_t before = doubtful_.size();
    for (std::size_t k = doubtful_.size(); k-- > 0;) {
      const std::size_t facet = doubtful_[k], begin = begin_of(facet), end = loop_ends_[facet];
      bool known = false, reverse = false;
      for (std::size_t i = begin; i < end && !known; ++i) {
        const std::uint16_t from = loops_[i], to = loops_[i + 1 < end ? i + 1 : begin];
        for (std::size_t other = 0; other < loop_ends_.size() && !known; ++other) {
          if (other == facet || is_doubtful(other)) continue;
          reverse = runs_along(other, from, to);
          known = reverse || runs_along(other, to, from);
        }
      }
      if (!known) continue;
      if (reverse)
        std::reverse(loops_.begin() + static_cast<std::ptrdiff_t>(begin),
                     loops_.begin() + static_cast<std::ptrdiff_t>(end));
      doubtful_.erase(doubtful_.begin() + static_cast<std::ptrdiff_t>(k));
    }
    if (doubtful_.size() == before) return;  // cannot be: the facets around a cell are connected
  }
}

/// The facets that miss the first vertex in triangles: a fan over each, whose edges may come in any order.
template <int D>
void CellWriter<D>::cut_into_triangles(const Cell<D>& cell) {
  const std::uint16_t* const ends = cell.subfaces(1, 0).data();  // two of each edge
  triangles_.resize(std::max(triangles_.size(), 2 * cell.face_count(1) + lanes));
  triangle_count_ = 0;
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    const auto edges = cell.subfaces(2, facet);
    const std::uint16_t apex = ends[2 * edges[0]];
    std::size_t found = triangle_count_;
    bool is_at_first = false;
    for (const std::uint16_t edge :
         edges) {  // without branches: there is no telling which edges meet the apex
      const std::uint16_t a = ends[2 * edge], b = ends[2 * edge + 1];
      triangles_[found] = {apex, a, b};
      found += ((a != apex) & (b != apex)) ? 1 : 0;
      is_at_first |= (a == 0) | (b == 0);
    }
    if (!is_at_first) triangle_count_ = found;
  }
  while (triangle_count_ % lanes != 0) triangles_[triangle_count_++] = {0, 0, 0};
}

template <int D>
Moments<D> CellWriter<D>::measure(const Cell<D>& cell) {
  Moments<D> moments;
  if constexpr (D == 3) {
    const auto vertices = cell.vertices();
    const auto& origin = vertices[0].x;
    seen_from_first_.resize(vertices.size());
    for (std::size_t v = 0; v < vertices.size(); ++v)
      for (int i = 0; i < 3; ++i) seen_from_first_[v][i] = vertices[v].x[i] - origin[i];
    cut_into_triangles(cell);
    add_tetrahedra(seen_from_first_.data(), std::span(triangles_).first(triangle_count_), moments);
    move_undivided<D>(origin, moments);
  } else {
    SimplexCutter<D>(cell, moments).run();
  }
  finish(moments);
  return moments;
}

template <int D>
Moments<D> CellWriter<D>::append(const Cell<D>& cell, CellBatch& batch) {
  const Moments<D> moments = measure(cell);
  order_facets(cell);
  batch.dimension = D;
  const auto vertices = cell.vertices();
  const std::size_t first_coordinate = batch.points.size();
  batch.points.resize(first_coordinate + vertices.size() * D);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    std::copy_n(vertices[v].x.data(), D, batch.points.data() + first_coordinate + v * D);
  batch.point_offset.push_back(static_cast<std::uint32_t>(batch.points.size() / D));
  const auto end_facet = [&](OrientedHyperplane code, std::size_t end) {
    batch.facet_vertex_offset.push_back(static_cast<std::uint32_t>(end));
    const auto id = static_cast<std::int32_t>(code.id());
    batch.facet_hyperplane.push_back(code.flipped() ? ~id : id);
  };
  if constexpr (D == 1) {
    const auto ends = cell.vertices();
    for (std::uint16_t i = 0; i < 2; ++i) {
      batch.facet_vertices.push_back(i);
      const HyperplaneId id = ends[i].hyperplanes[0];
      const bool outward = ends[i].x[0] > ends[1 - i].x[0];
      end_facet(oriented(id, (table_->rounded(id).normal[0] > 0) != outward), batch.facet_vertices.size());
    }
  } else if constexpr (D == 3) {
    const auto first = static_cast<std::uint32_t>(batch.facet_vertices.size());
    batch.facet_vertices.insert(batch.facet_vertices.end(), loops_.begin(), loops_.end());
    for (std::size_t facet = 0; facet < loop_ends_.size(); ++facet)
      end_facet(cell.facet_hyperplane(facet), first + loop_ends_[facet]);
  } else {
    for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
      const auto corners = facet_vertices(cell, facet);
      batch.facet_vertices.insert(batch.facet_vertices.end(), corners.begin(), corners.end());
      end_facet(cell.facet_hyperplane(facet), batch.facet_vertices.size());
    }
  }
  batch.facet_offset.push_back(static_cast<std::uint32_t>(batch.facet_hyperplane.size()));
  batch.volume.push_back(moments.volume());
  return moments;
}

#define BSP2_INSTANTIATE(D)    \
  template class MomentSum<D>; \
  template class CellWriter<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
