#include "mesh/predicates.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>

namespace bsp2::model {
namespace {

int sign(double x) { return (x > 0) - (x < 0); }

/// x - y if that is a double, i.e. if the rounding error (Knuth's two-sum) is zero.
bool exact_difference(double x, double y, double& difference) {
  difference = x - y;
  const double back = x - difference;
  return (x - (difference + back)) + (back - y) == 0;
}

/// Whole numbers in the proportions of finite coordinates: multiples of a power of two that is below all
/// their digits.
class WholeNumbers {
 public:
  using Integer =
      boost::multiprecision::number<boost::multiprecision::cpp_int_backend<512>>;  // and more, from the heap

  explicit WholeNumbers(std::initializer_list<std::span<const double>> points) {
    for (const auto point : points)
      for (const double x : point)
        if (x != 0) least_ = std::min(least_, std::ilogb(x));
  }
  Integer operator()(double x) const {
    if (x == 0) return 0;
    const int exponent = std::ilogb(x);
    return Integer(static_cast<std::int64_t>(std::ldexp(x, 52 - exponent)))
           << static_cast<unsigned>(exponent - least_);
  }

 private:
  int least_ = std::numeric_limits<int>::max();
};

int exact_orientation(const Point2& a, const Point2& b, const Point2& c) {
  const std::array<double, 6> all{a.u, a.v, b.u, b.v, c.u, c.v};
  const WholeNumbers whole({all});
  const auto cu = whole(c.u), cv = whole(c.v);
  const WholeNumbers::Integer left = (whole(a.u) - cu) * (whole(b.v) - cv),
                              right = (whole(a.v) - cv) * (whole(b.u) - cu);
  return left.compare(right);
}

int exact_orientation(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  const WholeNumbers whole({a, b, c, d});
  std::array<WholeNumbers::Integer, 3> u, v, w;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto origin = whole(d[k]);
    u[k] = whole(a[k]) - origin, v[k] = whole(b[k]) - origin, w[k] = whole(c[k]) - origin;
  }
  WholeNumbers::Integer determinant = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    determinant += u[k] * (v[l] * w[m] - v[m] * w[l]);
  }
  return -determinant.sign();
}

/// The sign, where doubles tell for sure.
std::optional<int> quick_orientation(const Point2& a, const Point2& b, const Point2& c) {
  // The sign of a difference of doubles is exact, so it decides alone where the products differ in sign or
  // vanish.
  const int left_sign = sign(a.u - c.u) * sign(b.v - c.v), right_sign = sign(a.v - c.v) * sign(b.u - c.u);
  if (left_sign != right_sign) return left_sign > right_sign ? 1 : -1;
  if (left_sign == 0) return 0;
  const double left = (a.u - c.u) * (b.v - c.v), right = (a.v - c.v) * (b.u - c.u);
  const double determinant = left - right;
  // Shewchuk's bound for this expression, (3 + 16 eps) eps, a little enlarged; no underflow above 1e-290.
  const double bound = 3.4e-16 * (std::fabs(left) + std::fabs(right));
  if (std::fabs(determinant) > bound && bound > 1e-290 && bound < std::numeric_limits<double>::max())
    return sign(determinant);

  // Round coordinates: the differences are doubles, so the fused products decide.
  double au, av, bu, bv;
  const bool exact = exact_difference(a.u, c.u, au) & exact_difference(a.v, c.v, av) &
                     exact_difference(b.u, c.u, bu) & exact_difference(b.v, c.v, bv);
  if (!exact || bound <= 1e-270 || bound >= 1e270) return std::nullopt;
  const double p = au * bv, q = av * bu;
  if (p != q) return sign(p - q);  // rounding is monotone
  return sign(std::fma(au, bv, -p) - std::fma(av, bu, -q));
}

/// -1, 0 or 1 by integers of 128 bits, where the coordinates are multiples of one power of two that are not
/// too many.
std::optional<int> integer_orientation(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  double difference[3][3], largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!exact_difference(a[k], d[k], difference[0][k]) || !exact_difference(b[k], d[k], difference[1][k]) ||
        !exact_difference(c[k], d[k], difference[2][k]))
      return std::nullopt;
    for (const auto& row : difference) largest = std::max(largest, std::fabs(row[k]));
  }
  if (largest == 0) return 0;
  if (!(largest > 1e-280 && largest < 1e280)) return std::nullopt;
  const double scale = std::ldexp(
      1.0, 39 - std::ilogb(largest));  // then all are below 2^40, minors below 2^81, the sum below 2^124
  std::int64_t m[3][3];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double scaled = difference[i][k] * scale;
      m[i][k] = static_cast<std::int64_t>(scaled);
      if (static_cast<double>(m[i][k]) != scaled || (scaled == 0) != (difference[i][k] == 0))
        return std::nullopt;
    }
  __extension__ using Wide = __int128;
  Wide determinant = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, n = (k + 2) % 3;
    determinant += m[0][k] * (Wide{m[1][l]} * m[2][n] - Wide{m[1][n]} * m[2][l]);
  }
  return determinant > 0 ? -1 : determinant < 0 ? 1 : 0;
}

}  // namespace

int orientation(const Point2& a, const Point2& b, const Point2& c) {
  const std::optional<int> quick = quick_orientation(a, b, c);
  return quick ? *quick : exact_orientation(a, b, c);
}

std::optional<int> quick_orientation(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  Point3 u, v, w;
  for (std::size_t k = 0; k < 3; ++k) u[k] = a[k] - d[k], v[k] = b[k] - d[k], w[k] = c[k] - d[k];
  double determinant = 0, permanent = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    const double left = v[l] * w[m], right = v[m] * w[l];
    determinant += u[k] * (left - right);
    permanent += std::fabs(u[k]) * (std::fabs(left) + std::fabs(right));
  }
  // Shewchuk's bound for this expression is (7 + 56 eps) eps, here twice that; no underflow above 1e-290.
  const double bound = 1.6e-15 * permanent;
  if (std::fabs(determinant) > bound && bound > 1e-290 && bound < std::numeric_limits<double>::max())
    return -sign(determinant);
  return std::nullopt;
}

int orientation(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  if (const std::optional<int> quick = quick_orientation(a, b, c, d)) return *quick;
  if (const std::optional<int> quick = integer_orientation(a, b, c, d)) return *quick;
  return exact_orientation(a, b, c, d);
}

bool collinear(const Point3& a, const Point3& b, const Point3& c) {
  bool is_sure = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::optional<int> quick = quick_orientation({a[i], a[j]}, {b[i], b[j]}, {c[i], c[j]});
    if (quick && *quick != 0) return false;
    is_sure = is_sure && quick;
  }
  if (is_sure) return true;
  return orientation({a[0], a[1]}, {b[0], b[1]}, {c[0], c[1]}) == 0 &&
         orientation({a[1], a[2]}, {b[1], b[2]}, {c[1], c[2]}) == 0 &&
         orientation({a[2], a[0]}, {b[2], b[0]}, {c[2], c[0]}) == 0;
}

bool inside_segment(const Point3& a, const Point3& b, const Point3& v) {
  if (v == a || v == b || !collinear(a, b, v)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax(a[axis], b[axis]);
    if (v[axis] < low || v[axis] > high) return false;
  }
  return true;
}

}  // namespace bsp2::model
