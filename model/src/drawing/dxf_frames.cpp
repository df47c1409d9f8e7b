#include "drawing/dxf_frames.hpp"

#include <algorithm>
#include <cmath>

namespace bsp2::model::dxf {
namespace {

double length(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }

Vector divided(const Vector& v, double by) { return {v[0] / by, v[1] / by, v[2] / by}; }

}  // namespace

Map Map::of(const Vector& x, const Vector& y, const Vector& z) {
  Map map;
  for (std::size_t i = 0; i < 3; ++i) map.rows_[i] = {x[i], y[i], z[i]};
  return map;
}

Map Map::turned(double c, double s, const Vector& to) {
  Map map;
  map.rows_ = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
  map.to_ = to;
  return map;
}

Map Map::scaled(const Vector& factors, const Vector& about) {
  Map map;
  for (std::size_t i = 0; i < 3; ++i) map.rows_[i][i] = factors[i], map.to_[i] = -factors[i] * about[i];
  return map;
}

Vector Map::operator()(double x, double y, double z) const {
  Vector p;
  for (std::size_t i = 0; i < 3; ++i) p[i] = rows_[i][0] * x + rows_[i][1] * y + rows_[i][2] * z + to_[i];
  return p;
}

Map Map::after(const Map& m) const {
  Map map;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      map.rows_[i][j] =
          rows_[i][0] * m.rows_[0][j] + rows_[i][1] * m.rows_[1][j] + rows_[i][2] * m.rows_[2][j];
  map.to_ = (*this)(m.to_[0], m.to_[1], m.to_[2]);
  return map;
}

double Map::stretch() const {
  const double a = rows_[0][0], b = rows_[0][1], c = rows_[1][0], d = rows_[1][1];
  if ((b == 0 && c == 0) || (a == 0 && d == 0))
    return std::max({std::fabs(a), std::fabs(b), std::fabs(c), std::fabs(d)});
  // The larger singular value: half the sum of those of the parts that turn and that mirror.
  return (std::hypot(a + d, c - b) + std::hypot(a - d, c + b)) / 2;
}

Vector across(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector normal_of(const Entity& e) {
  const Vector n{e.number(210), e.number(220), e.number(230, e.has(210) ? 0 : 1)};
  const double l = length(n);
  return l > 0 && std::isfinite(l) ? divided(n, l) : Vector{0, 0, 1};
}

Map plane_of(const Entity& e) {
  const Vector z = normal_of(e);
  if (z[0] == 0 && z[1] == 0) return z[2] > 0 ? Map() : Map::of({-1, 0, 0}, {0, 1, 0}, {0, 0, -1});
  constexpr double nearly_upright = 1.0 / 64;
  const bool is_upright = std::fabs(z[0]) < nearly_upright && std::fabs(z[1]) < nearly_upright;
  Vector x = across(is_upright ? Vector{0, 1, 0} : Vector{0, 0, 1}, z);
  x = divided(x, length(x));
  return Map::of(x, across(z, x), z);
}

}  // namespace bsp2::model::dxf
