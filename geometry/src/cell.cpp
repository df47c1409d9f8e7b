#include "bsp2/geometry/cell.hpp"

#include <cmath>
#include <cstring>

#include "bsp2/geometry/dimensions.hpp"
#include "bsp2/geometry/splitter.hpp"

namespace bsp2::geometry {
namespace {

template <int D>
Vertex<D> exact_vertex(const HyperplaneTable<D>& table, const std::array<HyperplaneId, D>& ids) {
  std::array<ExactCovector<D>, D> rows;
  for (int i = 0; i < D; ++i) rows[i] = table.exact(ids[i]);
  const auto point = meeting_point<D>(rows);
  Vertex<D> vertex{{}, 8 * D * 0x1p-53 * table.radius(), ids};
  const auto top = static_cast<long>(mp::msb(ExactInteger<D>(mp::abs(point[D]))));
  const double weight = scaled_to_double(point[D], top);
  for (int i = 0; i < D; ++i) vertex.x[i] = scaled_to_double(point[i], top - table.grid_exponent()) / weight;
  return vertex;
}

/// The rounded meeting point and its error bound.
///
/// With the approximate inverse M of the normals N and the point x = -M d: the exact point differs from x by N^-1 r, r
/// the exact values of the hyperplanes at x, |r_i| <= |h_i(x)| + error_i, and |N^-1| <= |M| / (1 - |I - M N|).
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

/// The same by Cramer's rule; the rows of N^-1 are cross products over the determinant.
bool solve_by_cross_products(const std::array<Hyperplane<3>, 3>& h, Vertex<3>& vertex) {
  const auto cross = [](const std::array<double, 3>& u, const std::array<double, 3>& v) {
    return std::array<double, 3>{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  };
  const auto c0 = cross(h[1].normal, h[2].normal), c1 = cross(h[2].normal, h[0].normal), c2 = cross(h[0].normal, h[1].normal);
  const double w = h[0].normal[0] * c0[0] + h[0].normal[1] * c0[1] + h[0].normal[2] * c0[2];
  const double size = std::fabs(w);
  if (size < 0x1p-24) return false;
  const double inverse = -1 / w;
  for (int i = 0; i < 3; ++i) vertex.x[i] = (h[0].offset * c0[i] + h[1].offset * c1[i] + h[2].offset * c2[i]) * inverse;
  // Of the lengths of the cross products, not less than them.
  const auto length = [](const std::array<double, 3>& v) { return std::fabs(v[0]) + std::fabs(v[1]) + std::fabs(v[2]); };
  const double residual = (std::fabs(h[0].at(vertex.x)) + h[0].error) * length(c0) +
                          (std::fabs(h[1].at(vertex.x)) + h[1].error) * length(c1) +
                          (std::fabs(h[2].at(vertex.x)) + h[2].error) * length(c2);
  // Cross products and w are off by less than 2^-49, and size >= 2^-24: their relative errors are far below 2^-20, and
  // lengths of nearly parallel normals by less than 2^-49 each, which the second term covers.
  const double sum = std::fabs(h[0].error) + h[1].error + h[2].error;
  vertex.error = (residual * (1 + 0x1p-20) + sum * 0x1p-20) / size;
  return true;
}

}  // namespace

template <int D>
Vertex<D> make_vertex(const HyperplaneTable<D>& table, const std::array<HyperplaneId, D>& ids, std::uint64_t& exact_evaluations) {
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
  ++exact_evaluations;
  return exact_vertex<D>(table, ids);
}

template <int D>
Cell<D> Cell<D>::copy() const {
  Cell result;
  result.block_ = Block(block_.size());
  std::memcpy(result.block_.template at<std::byte>(0), block_.template at<std::byte>(0), block_.size());
  result.vertex_count_ = vertex_count_;
  result.levels_ = levels_;
  return result;
}

namespace {

/// The k-faces of a box are the strings over {low, high, free} with k times free.
template <int D>
class BoxBuilder {
 public:
  explicit BoxBuilder(const HyperplaneTable<D>& table) : table_(table) {}

  Cell<D> build() {
    std::array<std::vector<std::array<int, D>>, D> faces;
    const int total = static_cast<int>(std::pow(3, D) + 0.5);
    for (int code = 0; code < total; ++code) {
      std::array<int, D> sides{};
      int free = 0, rest = code;
      for (int& side : sides) {
        side = rest % 3;
        rest /= 3;
        free += side == 2;
      }
      if (free < D) faces[free].push_back(sides);
    }
    CellScratch<D> scratch;
    std::uint64_t exact = 0;
    for (const auto& sides : faces[0]) {
      std::array<HyperplaneId, D> ids;
      for (int axis = 0; axis < D; ++axis) ids[axis] = hyperplane(axis, sides[axis]).id();
      scratch.add_vertex(make_vertex<D>(table_, ids, exact));
    }
    for (int k = 1; k < D; ++k)
      for (const auto& sides : faces[k]) {
        std::vector<std::uint32_t> codes;
        for (int axis = 0; axis < D; ++axis)
          if (sides[axis] != 2) codes.push_back(k == D - 1 ? hyperplane(axis, sides[axis]).code : hyperplane(axis, sides[axis]).id());
        scratch.add_face(k, codes.data());
        for (std::size_t sub = 0; sub < faces[k - 1].size(); ++sub)
          if (covers(sides, faces[k - 1][sub])) scratch.add_subface(k, static_cast<std::uint16_t>(sub));
        scratch.close_face(k);
      }
    return scratch.pack();
  }

 private:
  const HyperplaneTable<D>& table_;

  OrientedHyperplane hyperplane(int axis, int side) const {  // inside negative
    return oriented(table_.axis_hyperplane(axis, side == 0 ? table_.root_lower() : table_.root_upper()), side == 0);
  }
  static bool covers(const std::array<int, D>& face, const std::array<int, D>& sub) {
    for (int axis = 0; axis < D; ++axis)
      if (face[axis] != 2 && face[axis] != sub[axis]) return false;
    return true;
  }
};

}  // namespace

template <int D>
Cell<D> root_cell(const HyperplaneTable<D>& table) {
  return BoxBuilder<D>(table).build();
}

#define BSP2_INSTANTIATE(D)                                                                                          \
  template class Cell<D>;                                                                                            \
  template Cell<D> root_cell<D>(const HyperplaneTable<D>&);                                                          \
  template Vertex<D> make_vertex<D>(const HyperplaneTable<D>&, const std::array<HyperplaneId, D>&, std::uint64_t&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
