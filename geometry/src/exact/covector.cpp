#include "bsp2/geometry/exact/covector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::geometry {
namespace {

constexpr double direction_unit = 0x1p53;

long double rounded(const LocalInteger& value) {
  if (value.is_zero()) return 0;
  const LocalInteger magnitude = mp::abs(value);
  const long top = static_cast<long>(mp::msb(magnitude)) - 63;
  const std::uint64_t leading = top > 0 ? static_cast<std::uint64_t>(LocalInteger(magnitude >> top))
                                        : static_cast<std::uint64_t>(magnitude);
  const long double result =
      std::ldexp(static_cast<long double>(leading), static_cast<int>(std::max(top, 0L)));
  return value.sign() < 0 ? -result : result;
}

/// Divides out the common power of two: simple primitives then stay simple in exact arithmetic.
template <std::size_t N>
void strip_powers_of_two(std::array<LocalInteger, N>& values) {
  unsigned shift = std::numeric_limits<unsigned>::max();
  for (const LocalInteger& value : values)
    if (!value.is_zero())
      shift = std::min(shift, static_cast<unsigned>(mp::lsb(LocalInteger(mp::abs(value)))));
  if (shift == 0 || shift == std::numeric_limits<unsigned>::max()) return;
  for (LocalInteger& value : values)
    value = value.sign() < 0 ? LocalInteger(-(LocalInteger(-value) >> shift)) : LocalInteger(value >> shift);
}

double outward(double value, double direction) {
  return std::nextafter(value, direction * std::numeric_limits<double>::infinity());
}

}  // namespace

template <int D>
Covector<D> make_covector(const std::array<LocalInteger, D + 1>& exact) {
  Covector<D> result{exact, {}};
  strip_powers_of_two(result.exact);
  for (int i = 0; i <= D; ++i) result.rounded[i] = rounded(result.exact[i]);
  return result;
}

template <int D>
Polytope<D> unit_box() {
  Polytope<D> box;
  for (int axis = 0; axis < D; ++axis) {
    std::array<LocalInteger, D + 1> low{}, high{};
    low[axis] = -1;  // -x <= 0
    high[axis] = 1;  // x - 1 <= 0
    high[D] = -1;
    box.covectors.push_back(make_covector<D>(low));
    box.covectors.push_back(make_covector<D>(high));
    box.lower[axis] = 0;
    box.upper[axis] = 1;
  }
  return box;
}

std::array<std::int64_t, 2> corner_direction(std::uint32_t index, std::uint32_t count) {
  // Reduce to the first octant in exact integer arithmetic: eighths * 360/8 + rest, rest / (8 count) of a
  // turn.
  const std::uint64_t scaled = std::uint64_t{index % count} * 8;
  const auto octant = static_cast<unsigned>(scaled / count);
  const std::uint64_t rest = octant % 2 == 0 ? scaled % count : count - scaled % count;
  const long double angle = std::numbers::pi_v<long double> / 4 * rest / count;
  long double cosine = std::cos(angle), sine = std::sin(angle);
  if (3 * rest == 2 * std::uint64_t{count}) {  // 30 degrees
    cosine = std::sqrt(3.0L) / 2;
    sine = 0.5L;
  } else if (rest == count) {  // 45 degrees
    cosine = sine = std::sqrt(0.5L);
  }
  auto c = std::llround(cosine * direction_unit), s = std::llround(sine * direction_unit);
  if ((octant + 1) / 2 % 2 == 1) std::swap(c, s);
  if (octant >= 2 && octant < 6) c = -c;
  if (octant >= 4) s = -s;
  return {c, s};
}

Polytope<3> lathe(std::uint32_t sides, std::span<const double> radius, std::span<const double> z) {
  using I = LocalInteger;
  // Radii R and heights Z as multiples of 2^-53. A corner is (R C, R S, Z) with x and y in units of 2^-106.
  std::vector<std::int64_t> r, h;
  for (const double value : radius) r.push_back(std::llround(std::ldexp(value, 53)));
  for (const double value : z) h.push_back(std::llround(std::ldexp(value, 53)));
  Polytope<3> result;
  const auto add = [&](const I& a, const I& b, const I& c, const I& d) {
    result.covectors.push_back(make_covector<3>({a, b, c, d}));
  };
  if (r.front() > 0) add(0, 0, -(I(1) << 53), I(h.front()));
  if (r.back() > 0) add(0, 0, I(1) << 53, -I(h.back()));
  for (std::uint32_t j = 0; j < sides; ++j) {
    const auto [c0, s0] = corner_direction(j, sides);
    const auto [c1, s1] = corner_direction((j + 1) % sides, sides);
    const I chord_x = I(c1) - c0, chord_y = I(s1) - s0;
    const I cross = I(c0) * s1 - I(c1) * s0;
    for (std::size_t i = 0; i + 1 < r.size(); ++i) {
      // In units X = 2^106 x, Y = 2^106 y, Z = 2^53 z:
      //   (Z1-Z0) (chord_y X - chord_x Y) - (R1-R0) cross Z + cross (R1 Z0 - R0 Z1) = 0, positive outside.
      const I rise = I(h[i + 1]) - h[i], growth = I(r[i + 1]) - r[i];
      const I constant = cross * (I(r[i + 1]) * h[i] - I(r[i]) * h[i + 1]);
      add((rise * chord_y) << 106, -((rise * chord_x) << 106), -((growth * cross) << 53), constant);
    }
  }
  const double widest = outward(*std::max_element(radius.begin(), radius.end()), 1);
  result.lower = {-widest, -widest, z.front()};
  result.upper = {widest, widest, z.back()};
  return result;
}

Covector<3> axial_covector(std::uint32_t corner, std::uint32_t sides) {
  const auto [c, s] = corner_direction(corner, sides);
  return make_covector<3>({LocalInteger(-s), LocalInteger(c), LocalInteger(0), LocalInteger(0)});
}

Covector<3> level_covector(double z) {
  const LocalInteger height = std::llround(std::ldexp(z, 53));
  return make_covector<3>({LocalInteger(0), LocalInteger(0), LocalInteger(1) << 53, LocalInteger(-height)});
}

Polytope<2> regular_polygon(std::uint32_t sides) {
  using I = LocalInteger;
  Polytope<2> result;
  for (std::uint32_t j = 0; j < sides; ++j) {
    const auto [c0, s0] = corner_direction(j, sides);
    const auto [c1, s1] = corner_direction((j + 1) % sides, sides);
    result.covectors.push_back(
        make_covector<2>({(I(s1) - s0) << 53, -((I(c1) - c0) << 53), I(c1) * s0 - I(c0) * s1}));
  }
  result.lower.fill(outward(-1, -1));
  result.upper.fill(outward(1, 1));
  return result;
}

template <int D>
Polytope<D> convex_polygon(std::span<const std::array<std::int64_t, 2>> points) {
  static_assert(D == 2 || D == 3);
  using I = LocalInteger;
  Polytope<D> result;
  result.lower.fill(0);
  result.upper.fill(1);
  for (int i = 0; i < 2; ++i) {
    result.lower[i] = std::numeric_limits<double>::infinity();
    result.upper[i] = -result.lower[i];
  }
  for (std::size_t j = 0; j < points.size(); ++j) {
    const auto &p = points[j], &q = points[(j + 1) % points.size()];
    for (int i = 0; i < 2; ++i) {
      result.lower[i] = std::min(result.lower[i], std::ldexp(static_cast<double>(p[i]), -53));
      result.upper[i] = std::max(result.upper[i], std::ldexp(static_cast<double>(p[i]), -53));
    }
    if (p == q) continue;
    std::array<I, D + 1> line{};
    line[0] = (I(q[1]) - p[1]) << 53;
    line[1] = -((I(q[0]) - p[0]) << 53);
    line[D] = I(q[0]) * p[1] - I(p[0]) * q[1];
    result.covectors.push_back(make_covector<D>(line));
  }
  if constexpr (D == 3) {
    result.covectors.push_back(make_covector<3>({I(0), I(0), I(-1), I(0)}));
    result.covectors.push_back(make_covector<3>({I(0), I(0), I(1), I(-1)}));
  }
  return result;
}

Covector<3> triangle_covector(const std::array<std::array<std::int64_t, 3>, 3>& points) {
  using I = LocalInteger;
  std::array<Int128, 3> u, v;  // of 54 bits, so the normal has less than 110
  for (int i = 0; i < 3; ++i) {
    u[i] = static_cast<Int128>(points[1][i]) - points[0][i];
    v[i] = static_cast<Int128>(points[2][i]) - points[0][i];
  }
  const I a = u[1] * v[2] - u[2] * v[1], b = u[2] * v[0] - u[0] * v[2], c = u[0] * v[1] - u[1] * v[0];
  return make_covector<3>(
      {a << 53, b << 53, c << 53, -(a * points[0][0] + b * points[0][1] + c * points[0][2])});
}

#define BSP2_INSTANTIATE(D)                                                        \
  template Covector<D> make_covector<D>(const std::array<LocalInteger, (D) + 1>&); \
  template Polytope<D> unit_box<D>();
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE
template Polytope<2> convex_polygon<2>(std::span<const std::array<std::int64_t, 2>>);
template Polytope<3> convex_polygon<3>(std::span<const std::array<std::int64_t, 2>>);

}  // namespace bsp2::geometry
