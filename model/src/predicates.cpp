#include "predicates.hpp"

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>

namespace bsp2::model {
namespace {

int sign(double x) {
  return (x > 0) - (x < 0);
}

/// x - y if that is a double, i.e. if the rounding error (Knuth's two-sum) is zero.
bool exact_difference(double x, double y, double& difference) {
  difference = x - y;
  const double back = x - difference;
  return (x - (difference + back)) + (back - y) == 0;
}

int rational_orientation(const Point2& a, const Point2& b, const Point2& c) {
  using Rational = boost::multiprecision::cpp_rational;
  const Rational cu(c.u), cv(c.v);
  const Rational left = (Rational(a.u) - cu) * (Rational(b.v) - cv);
  const Rational right = (Rational(a.v) - cv) * (Rational(b.u) - cu);
  return left.compare(right);
}

}  // namespace

int orientation(const Point2& a, const Point2& b, const Point2& c) {
  const double left = (a.u - c.u) * (b.v - c.v), right = (a.v - c.v) * (b.u - c.u);
  const double determinant = left - right;
  // Shewchuk's bound for this expression, (3 + 16 eps) eps, a little enlarged; no underflow above 1e-290.
  const double bound = 3.4e-16 * (std::fabs(left) + std::fabs(right));
  if (std::fabs(determinant) > bound && bound > 1e-290 && bound < std::numeric_limits<double>::max())
    return sign(determinant);

  // Lines parallel to an axis and round coordinates: the differences are doubles, so the fused products
  // decide.
  double au, av, bu, bv;
  const bool exact = exact_difference(a.u, c.u, au) & exact_difference(a.v, c.v, av) &
                     exact_difference(b.u, c.u, bu) & exact_difference(b.v, c.v, bv);
  if (exact && (au == 0 || bv == 0) && (av == 0 || bu == 0)) return 0;
  if (exact && bound > 1e-270 && bound < 1e270) {
    const double p = au * bv, q = av * bu;
    if (p != q) return sign(p - q);  // rounding is monotone
    return sign(std::fma(au, bv, -p) - std::fma(av, bu, -q));
  }
  return rational_orientation(a, b, c);
}

bool collinear(const Point3& a, const Point3& b, const Point3& c) {
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
