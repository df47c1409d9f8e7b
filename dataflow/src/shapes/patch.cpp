#include "bsp2/dataflow/shapes/patch.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {
namespace {

template <int D>
using Point = std::array<double, D>;

/// The sum of the points, each times its weight. Weights are >= 0 and sum up to 1: no mask leaves the convex
/// hull.
template <int D>
Point<D> mix(std::initializer_list<std::pair<double, Point<D>>> terms) {
  Point<D> sum{};
  for (const auto& [weight, point] : terms)
    for (std::size_t i = 0; i < D; ++i) sum[i] += weight * point[i];
  return sum;
}

template <int D>
Point<D> mean(std::initializer_list<Point<D>> points) {
  Point<D> sum{};
  for (const Point<D>& point : points)
    for (std::size_t i = 0; i < D; ++i) sum[i] += point[i];
  for (double& x : sum) x /= static_cast<double>(points.size());
  return sum;
}

template <int D>
Point<D> minus(const Point<D>& a, const Point<D>& b) {
  Point<D> difference;
  for (std::size_t i = 0; i < D; ++i) difference[i] = a[i] - b[i];
  return difference;
}

template <int D>
Point<D> plus(const Point<D>& a, const Point<D>& b) {
  Point<D> sum;
  for (std::size_t i = 0; i < D; ++i) sum[i] = a[i] + b[i];
  return sum;
}

// --- tensor products ---

/// Both halves along one parameter, by de Casteljau's construction.
template <int D>
std::pair<Patch<D>, Patch<D>> bisect(const Patch<D>& patch, int parameter) {
  std::pair<Patch<D>, Patch<D>> halves(patch, patch);
  const std::size_t degree = patch.degrees[static_cast<std::size_t>(parameter)];
  std::size_t inner = patch.stride();
  for (int j = parameter + 1; j < patch.parameters; ++j)
    inner *= patch.degrees[static_cast<std::size_t>(j)] + std::size_t{1};
  std::vector<double> line(degree + 1);
  for (std::size_t outer = 0; outer < patch.coordinates.size(); outer += (degree + 1) * inner)
    for (std::size_t i = outer; i < outer + inner; ++i) {
      for (std::size_t j = 0; j <= degree; ++j) line[j] = patch.coordinates[i + j * inner];
      for (std::size_t r = 0; r <= degree; ++r) {
        halves.first.coordinates[i + r * inner] = line[0];
        halves.second.coordinates[i + (degree - r) * inner] = line[degree - r];
        for (std::size_t j = 0; j < degree - r; ++j) line[j] = (line[j] + line[j + 1]) / 2;
      }
    }
  return halves;
}

template <int D>
std::vector<Patch<D>> tensor_halves(const Patch<D>& patch) {
  std::vector<Patch<D>> halves{patch};
  for (int j = 0; j < patch.parameters; ++j) {
    const std::size_t count = halves.size();
    halves.resize(2 * count);
    for (std::size_t i = 0; i < count; ++i) std::tie(halves[i], halves[i + count]) = bisect(halves[i], j);
  }
  return halves;
}

/// Index of the control point at the corner with this number.
template <int D>
std::size_t corner_index(const Patch<D>& patch, std::size_t corner) {
  std::size_t index = 0;
  for (std::size_t j = 0; j < patch.parameters; ++j)
    index = index * (patch.degrees[j] + std::size_t{1}) +
            ((corner >> j & 1) != 0 ? patch.degrees[j] : std::size_t{0});
  return index;
}

// --- Catmull-Clark ---

/// The corners around a quadrangle, by their places (x, y) on a grid: the quadrangle is [0, 1]^2, its
/// irregular corner v is (0, 0), around which there may be more or fewer quadrangles than 4.
///
///   (-1,2) (0,2) (1,2) (2,2)        quadrangle i around v has the corners v, e_i, f_i, e_(i+1);
///   f_1    e_1   f_0   (2,1)        outer ones are in the order (2,-1) (2,0) (2,1) (2,2) (1,2) (0,2) (-1,2)
///   e_2    v     e_0   (2,0)
///          e_N-1 f_N-1 (2,-1)
template <int D>
class CatmullClark {
 public:
  explicit CatmullClark(const Patch<D>& patch) : patch_(patch), n_(patch.valence) {
    for (std::size_t i = 0; i < n_; ++i) face_.push_back(mean<D>({v(), e(i), f(i), e(i + 1)}));
    lower_right_ = cell(1, -1), right_ = cell(1, 0), upper_right_ = cell(1, 1), up_ = cell(0, 1),
    upper_left_ = cell(-1, 1);
  }

  std::vector<Patch<D>> halves() const {
    Patch<D> first = patch_;
    first.coordinates.clear();
    const auto put = [&](const Point<D>& point) {
      first.coordinates.insert(first.coordinates.end(), point.begin(), point.end());
    };
    put(vertex());
    for (std::size_t i = 0; i < n_; ++i) put(spoke(i)), put(face_[i]);
    for (const auto& [x, y] : outer_places) put(fine(x, y));
    return {std::move(first), regular(0, -1), regular(-1, 0), regular(0, 0)};
  }

  std::vector<Point<D>> corners() const {
    const double n = static_cast<double>(n_), whole = n * (n + 5);
    Point<D> limit = mix<D>({{n * n / whole, v()}});
    for (std::size_t i = 0; i < n_; ++i)
      limit = plus<D>(limit, mix<D>({{4 / whole, e(i)}, {1 / whole, f(i)}}));
    return {limit, regular_limit(1, 0), regular_limit(0, 1), regular_limit(1, 1)};
  }

  static constexpr std::pair<int, int> outer_places[] = {{2, -1}, {2, 0}, {2, 1}, {2, 2},
                                                         {1, 2},  {0, 2}, {-1, 2}};

 private:
  const Patch<D>& patch_;
  std::size_t n_;
  std::vector<Point<D>> face_;  // the means of the quadrangles around v, then of the outer ones
  Point<D> lower_right_, right_, upper_right_, up_, upper_left_;

  Point<D> v() const { return patch_.point(0); }
  Point<D> e(std::size_t i) const { return patch_.point(1 + 2 * (i % n_)); }
  Point<D> f(std::size_t i) const { return patch_.point(2 + 2 * (i % n_)); }
  Point<D> at(int x, int y) const {
    for (std::size_t i = 0; i < 7; ++i)
      if (outer_places[i] == std::pair(x, y)) return patch_.point(1 + 2 * n_ + i);
    if (x == 1) return y == 1 ? f(0) : y == 0 ? e(0) : f(n_ - 1);
    if (x == 0) return y == 1 ? e(1) : y == 0 ? v() : e(n_ - 1);
    return y == 1 ? f(1) : e(2);
  }
  Point<D> cell(int x, int y) const {
    return mean<D>({at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)});
  }
  Point<D> spoke(std::size_t i) const {
    return mean<D>({v(), e(i), face_[i % n_], face_[(i + n_ - 1) % n_]});
  }
  Point<D> vertex() const {
    const double n = static_cast<double>(n_);
    Point<D> sum = mix<D>({{(n - 2) / n, v()}});
    for (std::size_t i = 0; i < n_; ++i)
      sum = plus<D>(sum, mix<D>({{1 / (n * n), e(i)}, {1 / (n * n), face_[i]}}));
    return sum;
  }
  /// The mean of the quadrangle at this place, by the grid of halves: x and y are odd.
  Point<D> face_at(int x, int y) const {
    if (x == 3) return y == -1 ? lower_right_ : y == 1 ? right_ : upper_right_;
    if (y == 3) return x == 1 ? up_ : upper_left_;
    return x == 1 ? (y == 1 ? face_[0] : face_[n_ - 1]) : face_[1];
  }
  /// A point of the halved surface, at (x, y) of a grid twice as fine.
  Point<D> fine(int x, int y) const {
    const bool odd_x = x % 2 != 0, odd_y = y % 2 != 0;
    if (odd_x && odd_y) return face_at(x, y);
    if (x == 0 && y == 0) return vertex();
    if (x == -1 && y == 0) return spoke(2);
    if (x == 0 && y == -1) return spoke(n_ - 1);
    if (odd_x)
      return mean<D>({at((x - 1) / 2, y / 2), at((x + 1) / 2, y / 2), face_at(x, y - 1), face_at(x, y + 1)});
    if (odd_y)
      return mean<D>({at(x / 2, (y - 1) / 2), at(x / 2, (y + 1) / 2), face_at(x - 1, y), face_at(x + 1, y)});
    const int i = x / 2, j = y / 2;
    const Point<D> faces =
        mean<D>({face_at(x - 1, y - 1), face_at(x + 1, y - 1), face_at(x - 1, y + 1), face_at(x + 1, y + 1)});
    const Point<D> edges = mean<D>({at(i - 1, j), at(i + 1, j), at(i, j - 1), at(i, j + 1)});
    return mix<D>({{0.25, faces}, {0.25, edges}, {0.5, at(i, j)}});
  }
  /// The half around which all is regular; its 4 x 4 points begin here.
  Patch<D> regular(int x, int y) const {
    std::array<std::array<Point<D>, 4>, 4> points;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        points[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = fine(x + i, y + j);
    return bezier_of_bspline<D>(points);
  }
  Point<D> regular_limit(int x, int y) const {
    const Point<D> edges = mean<D>({at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)});
    Point<D> diagonals;
    if (x == 1 && y == 0)
      diagonals = mean<D>({e(n_ - 1), at(2, -1), at(2, 1), e(1)});
    else if (x == 0)
      diagonals = mean<D>({e(2), at(1, 0), at(1, 2), at(-1, 2)});
    else
      diagonals = mean<D>({v(), at(2, 0), at(2, 2), at(0, 2)});
    return mix<D>({{4.0 / 9, at(x, y)}, {4.0 / 9, edges}, {1.0 / 9, diagonals}});
  }
};

// --- Loop ---

/// The corners around a triangle v, e_0, e_1: those around v counter-clockwise, and the outer ones p, q, r
/// around e_0 between e_(N-1) and e_1, then (r), s, t around e_1 between e_0 and e_2.
template <int D>
class Loop {
 public:
  explicit Loop(const Patch<D>& patch) : patch_(patch), n_(patch.valence) {}

  std::vector<Patch<D>> halves() const {
    const auto p = outer(0), q = outer(1), r = outer(2), s = outer(3), t = outer(4);
    const auto vertex = moved(v(), ring());
    const auto e0 = moved(e(0), {e(1), v(), e(n_ - 1), p, q, r}),
               e1 = moved(e(1), {v(), e(0), r, s, t, e(2)});
    std::vector<Point<D>> spokes;
    for (std::size_t i = 0; i < n_; ++i) spokes.push_back(edge(v(), e(i), e(i + 1), e(i + n_ - 1)));
    const auto spoke = [&](std::size_t i) { return spokes[i % n_]; };
    const auto before = edge(e(0), e(n_ - 1), v(), p), middle = edge(e(0), e(1), v(), r),
               after = edge(e(1), e(2), v(), t);
    const auto to_p = edge(e(0), p, e(n_ - 1), q), to_q = edge(e(0), q, p, r), to_r = edge(e(0), r, q, e(1));
    const auto r_to = edge(e(1), r, e(0), s), to_s = edge(e(1), s, r, t), to_t = edge(e(1), t, s, e(2));
    std::vector<Point<D>> first{vertex};
    first.insert(first.end(), spokes.begin(), spokes.end());
    first.insert(first.end(), {before, e0, middle, e1, after});
    const auto last = spoke(n_ - 1);
    return {make(first),
            make({e0, middle, spoke(0), before, to_p, to_q, to_r, r_to, e1, spoke(1), vertex, last}),
            make({e1, spoke(1), middle, r_to, to_s, to_t, after, spoke(2), vertex, spoke(0), e0, to_r}),
            make({middle, spoke(1), spoke(0), e0, to_r, r_to, e1, after, spoke(2), vertex, last, before})};
  }

  std::vector<Point<D>> corners() const {
    const auto p = outer(0), q = outer(1), r = outer(2), s = outer(3), t = outer(4);
    return {limit(v(), ring()), limit(e(0), {e(1), v(), e(n_ - 1), p, q, r}),
            limit(e(1), {v(), e(0), r, s, t, e(2)})};
  }

 private:
  const Patch<D>& patch_;
  std::size_t n_;

  Point<D> v() const { return patch_.point(0); }
  Point<D> e(std::size_t i) const { return patch_.point(1 + i % n_); }
  Point<D> outer(std::size_t i) const { return patch_.point(1 + n_ + i); }
  std::vector<Point<D>> ring() const {
    std::vector<Point<D>> ring;
    for (std::size_t i = 0; i < n_; ++i) ring.push_back(e(i));
    return ring;
  }
  static double beta(std::size_t n) {
    if (n == 6) return 1.0 / 16;
    const double c = 3.0 / 8 + std::cos(2 * std::numbers::pi / static_cast<double>(n)) / 4;
    return (5.0 / 8 - c * c) / static_cast<double>(n);
  }
  static Point<D> weighted(const Point<D>& centre, const std::vector<Point<D>>& around, double weight) {
    Point<D> sum = mix<D>({{1 - weight * static_cast<double>(around.size()), centre}});
    for (const Point<D>& point : around) sum = plus<D>(sum, mix<D>({{weight, point}}));
    return sum;
  }
  static Point<D> moved(const Point<D>& centre, const std::vector<Point<D>>& around) {
    return weighted(centre, around, beta(around.size()));
  }
  static Point<D> limit(const Point<D>& centre, const std::vector<Point<D>>& around) {
    return weighted(centre, around, 1 / (3 / (8 * beta(around.size())) + static_cast<double>(around.size())));
  }
  static Point<D> edge(const Point<D>& a, const Point<D>& b, const Point<D>& left, const Point<D>& right) {
    return mix<D>({{0.375, a}, {0.375, b}, {0.125, left}, {0.125, right}});
  }
  Patch<D> make(const std::vector<Point<D>>& points) const {
    Patch<D> half;
    half.kind = Patch<D>::Kind::loop;
    half.valence = static_cast<std::uint16_t>(points.size() - 6);
    for (const Point<D>& point : points)
      half.coordinates.insert(half.coordinates.end(), point.begin(), point.end());
    return half;
  }
};

}  // namespace

template <int D>
Patch<D> bezier_of_bspline(const std::array<std::array<Point<D>, 4>, 4>& points) {
  const auto along = [](const std::array<Point<D>, 4>& p) {
    return std::array<Point<D>, 4>{mix<D>({{1.0 / 6, p[0]}, {2.0 / 3, p[1]}, {1.0 / 6, p[2]}}),
                                   mix<D>({{2.0 / 3, p[1]}, {1.0 / 3, p[2]}}),
                                   mix<D>({{1.0 / 3, p[1]}, {2.0 / 3, p[2]}}),
                                   mix<D>({{1.0 / 6, p[1]}, {2.0 / 3, p[2]}, {1.0 / 6, p[3]}})};
  };
  std::array<std::array<Point<D>, 4>, 4> rows, columns;
  for (std::size_t i = 0; i < 4; ++i) rows[i] = along(points[i]);
  for (std::size_t j = 0; j < 4; ++j) columns[j] = along({rows[0][j], rows[1][j], rows[2][j], rows[3][j]});
  Patch<D> patch;
  patch.degrees[0] = 3;
  if constexpr (D > 1) patch.degrees[1] = 3;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      patch.coordinates.insert(patch.coordinates.end(), columns[j][i].begin(), columns[j][i].end());
  return patch;
}

template <int D>
typename Patch<D>::Point Patch<D>::point(std::size_t index) const {
  Point point;
  const double* at = coordinates.data() + index * stride();
  for (std::size_t i = 0; i < D; ++i) point[i] = rational ? at[i] / at[D] : at[i];
  return point;
}

template <int D>
std::vector<Patch<D>> Patch<D>::halves() const {
  if (kind == Kind::catmull_clark) return CatmullClark<D>(*this).halves();
  if (kind == Kind::loop) return Loop<D>(*this).halves();
  return tensor_halves(*this);
}

template <int D>
std::vector<typename Patch<D>::Point> Patch<D>::corners() const {
  if (kind == Kind::catmull_clark) return CatmullClark<D>(*this).corners();
  if (kind == Kind::loop) return Loop<D>(*this).corners();
  std::vector<Point> corners;
  for (std::size_t corner = 0; corner < std::size_t{1} << parameters; ++corner)
    corners.push_back(point(corner_index(*this, corner)));
  return corners;
}

template <int D>
std::vector<typename Patch<D>::Point> Patch<D>::tangents() const {
  std::vector<Point> tangents(parameters, Point{});
  if (kind == Kind::loop) return {minus<D>(point(1), point(0)), minus<D>(point(2), point(0))};
  if (kind == Kind::catmull_clark) {
    const auto v = point(0), e0 = point(1), f0 = point(2), e1 = point(3);
    return {plus<D>(minus<D>(e0, v), minus<D>(f0, e1)), plus<D>(minus<D>(e1, v), minus<D>(f0, e0))};
  }
  const auto at = corners();
  for (std::size_t corner = 0; corner < at.size(); ++corner)
    for (std::size_t j = 0; j < parameters; ++j)
      tangents[j] =
          (corner >> j & 1) != 0 ? plus<D>(tangents[j], at[corner]) : minus<D>(tangents[j], at[corner]);
  return tangents;
}

/// A mean of two numbers is rounded once; a mask is a sum of so many products. Then points are divided by
/// their weight.
template <int D>
double Patch<D>::halving_error(double ratio) const {
  double roundings = 0;
  if (kind == Kind::tensor)
    for (std::size_t j = 0; j < parameters; ++j) roundings += degrees[j];
  else
    roundings = 8.0 * (valence + 8.0);
  return (roundings + 1) * 0x1p-52 * (rational ? 4 * ratio : 1);
}

#define BSP2_INSTANTIATE(D) \
  template struct Patch<D>; \
  template Patch<D> bezier_of_bspline<D>(const std::array<std::array<std::array<double, D>, 4>, 4>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
