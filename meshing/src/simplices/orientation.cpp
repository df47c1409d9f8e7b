#include "bsp2/meshing/simplices/orientation.hpp"

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bsp2::meshing {
namespace {

using Coordinates = std::array<double, 3>;
using Integer = boost::multiprecision::cpp_int;

template <typename Number>
Number determinant(const std::array<std::array<Number, 3>, 3>& m) {
  Number sum = 0;
  for (std::size_t k = 0; k < 3; ++k)
    sum += m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3]);
  return sum;
}

/// From integers in the proportions of the coordinates: multiples of the last digit that any of them has.
int exact_sign(const std::array<Coordinates, 4>& points) {
  int least = std::numeric_limits<int>::max();
  for (const Coordinates& p : points)
    for (const double x : p)
      if (x != 0) least = std::min(least, std::ilogb(x));
  const auto whole = [least](double x) {
    if (x == 0) return Integer(0);
    const int exponent = std::ilogb(x);
    return Integer(Integer(static_cast<std::int64_t>(std::ldexp(x, 52 - exponent)))
                   << static_cast<unsigned>(exponent - least));
  };
  std::array<std::array<Integer, 3>, 3> m;
  for (std::size_t k = 0; k < 3; ++k) {
    const Integer origin = whole(points[0][k]);
    for (std::size_t i = 0; i < 3; ++i) m[i][k] = whole(points[i + 1][k]) - origin;
  }
  return determinant(m).sign();
}

}  // namespace

int orientation(const Coordinates& a, const Coordinates& b, const Coordinates& c, const Coordinates& d) {
  std::array<std::array<double, 3>, 3> m;
  for (std::size_t k = 0; k < 3; ++k) m[0][k] = b[k] - a[k], m[1][k] = c[k] - a[k], m[2][k] = d[k] - a[k];
  const double value = determinant(m);
  double permanent = 0;
  for (std::size_t k = 0; k < 3; ++k)
    permanent += std::fabs(m[0][k]) * (std::fabs(m[1][(k + 1) % 3] * m[2][(k + 2) % 3]) +
                                       std::fabs(m[1][(k + 2) % 3] * m[2][(k + 1) % 3]));
  // Shewchuk's bound for this expression is (7 + 56 eps) eps of the permanent, here twice that; no underflow
  // above 1e-290.
  const double bound = 1.6e-15 * permanent;
  if (std::fabs(value) > bound && bound > 1e-290 && bound < std::numeric_limits<double>::max())
    return value > 0 ? 1 : -1;
  return exact_sign({a, b, c, d});
}

}  // namespace bsp2::meshing
