#include "outputs/orientation.hpp"

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bsp2::io {
namespace {

using Point = std::array<double, 3>;
using Integer = boost::multiprecision::cpp_int;

template <typename Number>
using Rows = std::array<std::array<Number, 3>, 3>;

/// From integers in the proportions of the coordinates: multiples of the last digit that any of them has.
int exact_sign(const std::array<Point, 4>& points) {
  int least = std::numeric_limits<int>::max();
  for (const Point& p : points)
    for (const double x : p)
      if (x != 0) least = std::min(least, std::ilogb(x));
  const auto whole = [least](double x) {
    if (x == 0) return Integer(0);
    const int exponent = std::ilogb(x);
    return Integer(Integer(static_cast<std::int64_t>(std::ldexp(x, 52 - exponent)))
                   << static_cast<unsigned>(exponent - least));
  };
  Rows<Integer> m;
  for (std::size_t k = 0; k < 3; ++k) {
    const Integer origin = whole(points[3][k]);
    for (std::size_t i = 0; i < 3; ++i) m[i][k] = whole(points[i][k]) - origin;
  }
  Integer determinant = 0;
  for (std::size_t k = 0; k < 3; ++k)
    determinant += m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3]);
  return -determinant.sign();
}

}  // namespace

int orientation(const Point& a, const Point& b, const Point& c, const Point& d) {
  Rows<double> m;
  for (std::size_t k = 0; k < 3; ++k) m[0][k] = a[k] - d[k], m[1][k] = b[k] - d[k], m[2][k] = c[k] - d[k];
  double determinant = 0, permanent = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double left = m[1][(k + 1) % 3] * m[2][(k + 2) % 3], right = m[1][(k + 2) % 3] * m[2][(k + 1) % 3];
    determinant += m[0][k] * (left - right);
    permanent += std::fabs(m[0][k]) * (std::fabs(left) + std::fabs(right));
  }
  // Shewchuk's bound for this expression is (7 + 56 eps) eps of the permanent, here twice that; no underflow
  // above 1e-290.
  const double bound = 1.6e-15 * permanent;
  if (std::fabs(determinant) > bound && bound > 1e-290 && bound < std::numeric_limits<double>::max())
    return determinant < 0 ? 1 : -1;
  return exact_sign({a, b, c, d});
}

}  // namespace bsp2::io
