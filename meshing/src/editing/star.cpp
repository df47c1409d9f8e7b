#include "editing/star.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

constexpr double nearly_worst = 2;  // so many times the square of the worst sine counts as nearly as bad

void add_to(Point& sum, double factor, const Point& x) {
  for (std::size_t k = 0; k < 3; ++k) sum[k] += factor * x[k];
}

/// The point nearest to the origin on the way from u to v.
Point shortest(const Point& u, const Point& v) {
  const Point way = v - u;
  const double length = dot(way, way);
  const double share = length > 0 ? std::clamp(-dot(u, way) / length, 0.0, 1.0) : 0;
  Point result = u;
  add_to(result, share, way);
  return result;
}

}  // namespace

void Star::add(const Point& a, const Point& b, const Point& c) {
  const Point normal = cross(c - a, b - a);
  spokes_.push_back({a, b, c, normal, dot(normal, normal), squared_distance(a, b), squared_distance(a, c),
                     squared_distance(b, c)});
}

Star::Look Star::look(const Spoke& s, const Point& x) {
  Look l;
  l.ad = x - s.a;
  l.bd = x - s.b;
  l.cd = x - s.c;
  l.n0 = cross(s.c - s.b, l.bd);
  l.n1 = cross(l.ad, s.c - s.a);
  l.n2 = cross(s.b - s.a, l.ad);
  l.six_volumes = -dot(s.normal, l.ad);
  l.a0 = dot(l.n0, l.n0);
  l.a1 = dot(l.n1, l.n1);
  l.a2 = dot(l.n2, l.n2);
  const double ad = dot(l.ad, l.ad), bd = dot(l.bd, l.bd), cd = dot(l.cd, l.cd);
  // As in shape_of, over one denominator.
  const std::array<double, 6> all{s.ab * l.a0 * l.a1, s.ac * l.a0 * l.a2, s.bc * l.a1 * l.a2,
                                  ad * l.a0 * s.area, bd * l.a1 * s.area, cd * l.a2 * s.area};
  l.edge = 0;
  for (int k = 1; k < 6; ++k)
    if (all[static_cast<std::size_t>(k)] < all[static_cast<std::size_t>(l.edge)]) l.edge = k;
  l.square =
      all[static_cast<std::size_t>(l.edge)] * l.six_volumes * l.six_volumes / (l.a0 * l.a1 * l.a2 * s.area);
  l.lengths = s.ab + s.ac + s.bc + ad + bd + cd;
  if (const double fullness = squared_fullness(l.six_volumes, l.lengths); fullness < l.square) {
    l.edge = no_edge;
    l.square = fullness;
  }
  return l;
}

Point Star::middle() const {
  Point sum{};
  for (const Spoke& spoke : spokes_)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += spoke.a[k] + spoke.b[k] + spoke.c[k];
  for (double& x : sum) x /= 3 * static_cast<double>(spokes_.size());
  return sum;
}

double Star::worst(const Point& x, double enough) const {
  double worst = 1;
  for (const Spoke& spoke : spokes_) {
    const Look l = look(spoke, x);
    // Where it is nearly flat, or squares are too small or too large for doubles, all is done with care.
    const bool is_clear = l.square > 1e-8 && l.square < 2 &&
                          l.six_volumes * l.six_volumes > 1e-26 * (spoke.ab * spoke.ac * dot(l.ad, l.ad));
    if (is_clear && l.six_volumes < 0) return -1;
    worst = std::min(worst, is_clear ? std::sqrt(l.square) : shape_of(spoke.a, spoke.b, spoke.c, x));
    if (worst <= enough) return worst;
  }
  return worst;
}

Point Star::gradient(const Spoke& s, const Look& l) {
  Point sum{};
  const auto area = [&](const Point& n, double square, const Point& edge) {
    add_to(sum, -2 / square, cross(n, edge));
  };
  const bool at_base = l.edge < 3;
  add_to(sum, -2 / l.six_volumes, s.normal);
  if (l.edge == no_edge) {
    for (const Point& edge : {l.ad, l.bd, l.cd}) add_to(sum, -6 / l.lengths, edge);
    return sum;
  }
  // Each angle is between two faces: those of the base are with the base, which does not change.
  if (at_base ? l.edge == 2 : l.edge != 3) area(l.n0, l.a0, s.c - s.b);
  if (at_base ? l.edge == 1 : l.edge != 4) area(l.n1, l.a1, s.a - s.c);
  if (at_base ? l.edge == 0 : l.edge != 5) area(l.n2, l.a2, s.b - s.a);
  if (l.edge == 3) add_to(sum, 2 / dot(l.ad, l.ad), l.ad);
  if (l.edge == 4) add_to(sum, 2 / dot(l.bd, l.bd), l.bd);
  if (l.edge == 5) add_to(sum, 2 / dot(l.cd, l.cd), l.cd);
  return sum;
}

std::optional<Point> Star::ascent(const Point& x) {
  slopes_.clear();
  double least = 1;
  for (const Spoke& spoke : spokes_) {
    const Look l = look(spoke, x);
    if (!(l.square > 0 && l.six_volumes > 0)) return std::nullopt;
    if (l.square > nearly_worst * least) continue;
    least = std::min(least, l.square);
    slopes_.push_back({l.square, gradient(spoke, l)});
  }
  std::erase_if(slopes_, [least](const Slope& slope) { return slope.square > nearly_worst * least; });
  if (slopes_.empty()) return std::nullopt;
  Point way = slopes_.front().gradient;
  for (const Slope& slope : slopes_)
    if (slope.square == least) way = slope.gradient;
  for (int step = 0; step < 12; ++step) {
    const Slope* against = &slopes_.front();
    for (const Slope& slope : slopes_)
      if (dot(slope.gradient, way) < dot(against->gradient, way)) against = &slope;
    if (dot(against->gradient, way) > 0.8 * dot(way, way)) break;
    way = shortest(way, against->gradient);
  }
  const double square = dot(way, way), reach = std::sqrt(dot(x - spokes_[0].a, x - spokes_[0].a));
  if (!(square * reach * reach > 1e-4)) return std::nullopt;
  for (double& k : way) k *= 0.8 / square;
  return way;
}

}  // namespace bsp2::meshing
