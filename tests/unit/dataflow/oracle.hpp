#pragma once

// Oracles of the dataflow tests: whether a point is in an expression, told by the expression itself in long
// double, without planes, cells or winding along segments; and random expressions.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/regions/partition.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "support/seeds.hpp"

namespace bsp2::dataflow {

using Real = long double;
using Point = std::vector<Real>;
using Random = std::mt19937_64;

using samples::new_seed;
inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline int pick(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}
inline bool chance(Random& random, double share) { return uniform(random, 0, 1) < share; }

// --- membership
// --------------------------------------------------------------------------------------------------

/// Where a point is: inside or outside, and whether it is nearer than `margin` to a boundary of some
/// primitive, in that primitive's own frame.
struct Where {
  bool inside = false, doubtful = false;
};

inline Where where(const model::Cuboid& box, const Point& x, Real margin) {
  Real furthest = -std::numeric_limits<Real>::infinity();
  for (std::size_t i = 0; i < x.size(); ++i)
    furthest = std::max({furthest, -x[i], x[i] - static_cast<Real>(box.size[i])});
  return {furthest < 0, std::fabs(furthest) < margin};
}

/// At each height the stack is a regular polygon; its radius is linear between two rings.
inline Where where(const model::Lathe& lathe, const Point& x, Real margin) {
  const auto& rings = lathe.rings;
  const Real z = x[2], low = rings.front().z, high = rings.back().z;
  if (z < low - margin || z > high + margin) return {false, false};
  std::size_t i = 0;
  while (i + 2 < rings.size() && z > static_cast<Real>(rings[i + 1].z)) ++i;
  const Real share = (z - rings[i].z) / (static_cast<Real>(rings[i + 1].z) - rings[i].z);
  const Real radius = rings[i].radius + std::clamp(share, Real{0}, Real{1}) *
                                            (static_cast<Real>(rings[i + 1].radius) - rings[i].radius);
  const Real step = 2 * std::numbers::pi_v<Real> / lathe.sides;
  Real furthest = std::max(low - z, z - high);
  for (std::uint32_t k = 0; k < lathe.sides; ++k) {
    const Real angle = step * (k + Real{0.5});
    furthest =
        std::max(furthest, x[0] * std::cos(angle) + x[1] * std::sin(angle) - radius * std::cos(step / 2));
  }
  return {furthest < 0, std::fabs(furthest) < margin};
}

inline Where where(const model::RegularPolygon& polygon, const Point& x, Real margin) {
  const Real step = 2 * std::numbers::pi_v<Real> / polygon.sides;
  Real furthest = -std::numeric_limits<Real>::infinity();
  for (std::uint32_t k = 0; k < polygon.sides; ++k) {
    const Real angle = step * (k + Real{0.5});
    furthest = std::max(
        furthest, x[0] * std::cos(angle) + x[1] * std::sin(angle) - polygon.radius * std::cos(step / 2));
  }
  return {furthest < 0, std::fabs(furthest) < margin};
}

/// With three coordinates: the prism over it, from 0 to 1.
inline Where where(const model::ConvexPolygon& polygon, const Point& x, Real margin) {
  Real furthest = x.size() == 3 ? std::max(-x[2], x[2] - 1) : -std::numeric_limits<Real>::infinity();
  for (std::size_t i = 0; i < polygon.points.size(); ++i) {
    const auto &p = polygon.points[i], &q = polygon.points[(i + 1) % polygon.points.size()];
    const Real dx = static_cast<Real>(q[0]) - p[0], dy = static_cast<Real>(q[1]) - p[1];
    furthest = std::max(furthest, ((x[0] - p[0]) * dy - (x[1] - p[1]) * dx) / std::hypot(dx, dy));
  }
  return {furthest < 0, std::fabs(furthest) < margin};
}

/// Signed distances to the round part (along it) and to the box.
inline Where where(const model::Round& round, const Point& x, Real margin) {
  const std::size_t axes = x.size() - round.lengths.size();
  Real square = 0, radius = round.bottom, furthest = -std::numeric_limits<Real>::infinity();
  for (std::size_t i = 0; i < axes; ++i) square += x[i] * x[i];
  for (std::size_t i = axes; i < x.size(); ++i)
    furthest = std::max({furthest, -x[i], x[i] - static_cast<Real>(round.lengths[i - axes])});
  if (round.bottom != round.top)
    radius += (static_cast<Real>(round.top) - round.bottom) * x[2] / round.lengths[0];
  furthest = std::max(furthest, std::sqrt(square) - radius);
  return {furthest < 0, std::fabs(furthest) < margin};
}

inline Where where(const model::Torus& torus, const Point& x, Real margin) {
  const Real rho = std::sqrt(x[0] * x[0] + x[1] * x[1]) - torus.major;
  const Real distance = std::sqrt(rho * rho + x[2] * x[2]) - torus.minor;
  return {distance < 0, std::fabs(distance) < margin};
}

/// The distance to the surface is at most what the height is off by, and at least that by the largest slope.
inline Where where(const model::Paraboloid& dish, const Point& x, Real margin) {
  const Real height = dish.height, radius = dish.radius, z = x.back();
  Real square = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) square += x[i] * x[i];
  const Real above = z - height * square / (radius * radius);
  const Real steepness = 2 * height * std::sqrt(std::max(square, radius * radius)) / (radius * radius);
  return {above > 0 && z < height,
          std::fabs(above) < margin * (1 + steepness) || std::fabs(z - height) < margin};
}

inline Where where(const model::Spline&, const Point&, Real) {
  throw std::logic_error("splines have tests of their own");
}
inline Where where(const model::Preimage&, const Point&, Real) {
  throw std::logic_error("sections and prisms are asked for what they are made of");
}
inline Where where(const model::SubdivisionSurface&, const Point&, Real) {
  throw std::logic_error("subdivision surfaces have tests of their own");
}

inline Real dot(const std::array<Real, 3>& a, const std::array<Real, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline std::array<Real, 3> cross(const std::array<Real, 3>& a, const std::array<Real, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The winding number as a sum of solid angles (Van Oosterom and Strackee 1983), divided by the full sphere.
inline Real winding_number(const model::TriangleMesh& mesh, const Point& x) {
  Real sum = 0;
  for (const auto& triangle : mesh.triangles) {
    std::array<std::array<Real, 3>, 3> v;
    std::array<Real, 3> length;
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) v[k][i] = static_cast<Real>(mesh.points[triangle[k]][i]) - x[i];
      length[k] = std::sqrt(dot(v[k], v[k]));
    }
    const Real numerator = dot(v[0], cross(v[1], v[2]));
    const Real denominator = length[0] * length[1] * length[2] + dot(v[0], v[1]) * length[2] +
                             dot(v[1], v[2]) * length[0] + dot(v[2], v[0]) * length[1];
    sum += 2 * std::atan2(numerator, denominator);
  }
  return sum / (4 * std::numbers::pi_v<Real>);
}

/// Whether the point is nearer than `margin` to a triangle: near its plane, and inside all edges' planes.
inline bool near_triangle(const model::TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                          const Point& x, Real margin) {
  std::array<std::array<Real, 3>, 3> v;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) v[k][i] = static_cast<Real>(mesh.points[triangle[k]][i]) - x[i];
  const auto edge = [&](int k) {
    const auto &a = v[k], &b = v[(k + 1) % 3];
    return std::array<Real, 3>{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  };
  const auto normal = cross(edge(0), edge(1));
  const Real size = std::sqrt(dot(normal, normal));
  if (size == 0) return false;
  if (std::fabs(dot(normal, v[0])) > margin * size) return false;
  for (int k = 0; k < 3; ++k) {
    const auto out = cross(edge(k), normal);
    if (-dot(out, v[k]) > margin * std::sqrt(dot(out, out))) return false;
  }
  return true;
}

inline Where where(const model::TriangleMesh& mesh, const Point& x, Real margin) {
  for (const auto& triangle : mesh.triangles)
    if (near_triangle(mesh, triangle, x, margin)) return {false, true};
  return {std::lround(winding_number(mesh, x)) != 0, false};
}

inline Where where(const model::Polytope& polytope, const Point& x, Real margin) {
  bool inside = true, doubtful = false;
  for (std::size_t at = 0; at < polytope.half_spaces.size(); at += x.size() + 1) {
    Real value = polytope.half_spaces[at + x.size()], square = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const auto normal = static_cast<Real>(polytope.half_spaces[at + i]);
      value += normal * x[i];
      square += normal * normal;
    }
    doubtful |= std::fabs(value) <= margin * std::sqrt(square);
    inside &= value <= 0;
  }
  return {inside, doubtful};
}

/// The preimage of a point under an affine map, by Gaussian elimination.
inline Point inverse_image(const std::vector<double>& matrix, const Point& x) {
  const std::size_t d = x.size();
  std::vector<std::vector<Real>> m(d, std::vector<Real>(d + 1));
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = 0; j < d; ++j) m[i][j] = matrix[i * (d + 1) + j];
    m[i][d] = x[i] - static_cast<Real>(matrix[i * (d + 1) + d]);
  }
  for (std::size_t k = 0; k < d; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < d; ++i)
      if (std::fabs(m[i][k]) > std::fabs(m[pivot][k])) pivot = i;
    std::swap(m[k], m[pivot]);
    for (std::size_t i = 0; i < d; ++i) {
      if (i == k) continue;
      const Real factor = m[i][k] / m[k][k];
      for (std::size_t j = k; j <= d; ++j) m[i][j] -= factor * m[k][j];
    }
  }
  Point y(d);
  for (std::size_t k = 0; k < d; ++k) y[k] = m[k][d] / m[k][k];
  return y;
}

inline Where where(const model::Expression& e, const Point& x, Real margin) {
  using model::Operation;
  if (const auto* primitive = std::get_if<model::Primitive>(&e.node().value))
    return std::visit([&](const auto& shape) { return where(shape, x, margin); }, *primitive);
  if (const auto* transform = std::get_if<model::Transform>(&e.node().value))
    return where(transform->child, inverse_image(transform->matrix, x), margin);
  const auto& boolean = std::get<model::Boolean>(e.node().value);
  bool inside = boolean.operation == Operation::intersect, first = true, doubtful = false;
  for (const model::Expression& child : boolean.children) {
    const Where w = where(child, x, margin);
    doubtful |= w.doubtful;
    switch (boolean.operation) {
      case Operation::unite:
        inside |= w.inside;
        break;
      case Operation::intersect:
        inside &= w.inside;
        break;
      case Operation::symmetric_difference:
        inside ^= w.inside;
        break;
      case Operation::complement:
        inside = !w.inside;
        break;
      case Operation::subtract:
        inside = first ? w.inside : inside && !w.inside;
        break;
    }
    first = false;
  }
  return {inside, doubtful};
}

/// The primitives in the order of the source, each as an expression of its own with all maps above it.
inline std::vector<model::Expression> occurrences(const model::Expression& e) {
  if (std::holds_alternative<model::Primitive>(e.node().value)) return {e};
  std::vector<model::Expression> all;
  if (const auto* transform = std::get_if<model::Transform>(&e.node().value)) {
    for (const auto& child : occurrences(transform->child))
      all.push_back(model::transform(transform->matrix, child));
  } else {
    for (const auto& operand : std::get<model::Boolean>(e.node().value).children)
      for (const auto& child : occurrences(operand)) all.push_back(child);
  }
  return all;
}

/// Whether the expression knows no complement: every point of it is in a primitive.
inline bool is_positive(const model::Expression& e) {
  if (const auto* transform = std::get_if<model::Transform>(&e.node().value))
    return is_positive(transform->child);
  const auto* boolean = std::get_if<model::Boolean>(&e.node().value);
  if (boolean == nullptr) return true;
  if (boolean->operation == model::Operation::complement) return false;
  return std::all_of(boolean->children.begin(), boolean->children.end(), is_positive);
}

// --- random expressions
// ------------------------------------------------------------------------------------------

/// (D+1) x (D+1) matrices for model::transform.
inline std::vector<double> identity_matrix(int d) {
  std::vector<double> m(static_cast<std::size_t>((d + 1) * (d + 1)));
  for (int i = 0; i <= d; ++i) m[static_cast<std::size_t>(i * (d + 1) + i)] = 1;
  return m;
}

/// A permutation of the axes with random signs and an integer translation: keeps the integer grid.
inline std::vector<double> grid_matrix(Random& random, int d, int reach) {
  std::vector<int> axes(static_cast<std::size_t>(d));
  for (int i = 0; i < d; ++i) axes[static_cast<std::size_t>(i)] = i;
  std::shuffle(axes.begin(), axes.end(), random);
  std::vector<double> m(static_cast<std::size_t>((d + 1) * (d + 1)));
  for (int i = 0; i < d; ++i) {
    m[static_cast<std::size_t>(i * (d + 1) + axes[static_cast<std::size_t>(i)])] =
        chance(random, 0.5) ? 1 : -1;
    m[static_cast<std::size_t>(i * (d + 1) + d)] = pick(random, -reach, reach);
  }
  m.back() = 1;
  return m;
}

/// A well-conditioned map that is nothing special: turned, sheared, stretched, perhaps mirrored.
inline std::vector<double> free_matrix(Random& random, int d, double reach) {
  std::vector<double> m = identity_matrix(d);
  for (int i = 0; i < d; ++i) {
    for (int j = 0; j < d; ++j)
      m[static_cast<std::size_t>(i * (d + 1) + j)] += uniform(random, -0.4, 0.4) / std::max(1, d - 1);
    m[static_cast<std::size_t>(i * (d + 1) + d)] = uniform(random, -reach, reach);
  }
  for (int turn = 0; d > 1 && turn < 2; ++turn) {
    const int a = pick(random, 0, d - 1), b = (a + pick(random, 1, d - 1)) % d;
    const double angle = uniform(random, 0, 6.3), c = std::cos(angle), s = std::sin(angle);
    for (int j = 0; j <= d; ++j) {
      double &x = m[static_cast<std::size_t>(a * (d + 1) + j)],
             &y = m[static_cast<std::size_t>(b * (d + 1) + j)];
      const double u = c * x - s * y, v = s * x + c * y;
      x = u;
      y = v;
    }
  }
  if (chance(random, 0.3))
    for (int j = 0; j < d; ++j) m[static_cast<std::size_t>(j)] = -m[static_cast<std::size_t>(j)];
  return m;
}

/// A prism over a polygon (corners counter-clockwise) between two heights, as a polyhedron.
inline model::Expression prism(const std::vector<std::array<double, 2>>& outline, double low, double high) {
  const auto n = static_cast<std::uint32_t>(outline.size());
  std::vector<std::array<double, 3>> points;
  for (const double z : {low, high})
    for (const auto& [x, y] : outline) points.push_back({x, y, z});
  std::vector<std::vector<std::uint32_t>> faces(2);  // clockwise seen from outside
  for (std::uint32_t i = 0; i < n; ++i) {
    faces[0].push_back(i);              // the bottom
    faces[1].push_back(2 * n - 1 - i);  // the top
    faces.push_back({i, n + i, n + (i + 1) % n, (i + 1) % n});
  }
  return model::polyhedron(points, faces);
}

inline model::Expression l_shape(double a, double b, double h) {
  return prism({{0, 0}, {a + 1, 0}, {a + 1, 1}, {1, 1}, {1, b + 1}, {0, b + 1}}, 0, h);
}

inline model::Expression star(int spikes, double outer, double inner, double h) {
  std::vector<std::array<double, 2>> outline;
  for (int i = 0; i < 2 * spikes; ++i) {
    const double angle = std::numbers::pi * i / spikes, r = i % 2 == 0 ? outer : inner;
    outline.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return prism(outline, 0, h);
}

/// Unit cubes of a grid glued together, one closed mesh: faces between a filled and an empty cube.
inline model::Expression polycube(const std::vector<std::array<int, 3>>& cubes) {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<std::uint32_t>> faces;
  const auto index = [&](const std::array<double, 3>& p) {
    const auto found = std::find(points.begin(), points.end(), p);
    if (found == points.end()) points.push_back(p);
    return static_cast<std::uint32_t>(std::find(points.begin(), points.end(), p) - points.begin());
  };
  for (const auto& cube : cubes)
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        auto neighbour = cube;
        neighbour[static_cast<std::size_t>(axis)] += side == 0 ? -1 : 1;
        if (std::find(cubes.begin(), cubes.end(), neighbour) != cubes.end()) continue;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::vector<std::uint32_t> face;
        for (const auto& [du, dv] : std::array<std::array<int, 2>, 4>{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}}) {
          std::array<double, 3> p{static_cast<double>(cube[0]), static_cast<double>(cube[1]),
                                  static_cast<double>(cube[2])};
          p[static_cast<std::size_t>(axis)] += side;
          p[static_cast<std::size_t>(u)] += du;
          p[static_cast<std::size_t>(v)] += dv;
          face.push_back(index(p));
        }
        if (side == 1) std::reverse(face.begin(), face.end());  // clockwise seen from outside
        faces.push_back(face);
      }
  return model::polyhedron(points, faces);
}

inline model::Expression random_polycube(Random& random, int count) {
  std::vector<std::array<int, 3>> cubes{{0, 0, 0}};
  while (static_cast<int>(cubes.size()) < count) {
    auto next = cubes[static_cast<std::size_t>(pick(random, 0, static_cast<int>(cubes.size()) - 1))];
    next[static_cast<std::size_t>(pick(random, 0, 2))] += chance(random, 0.5) ? 1 : -1;
    if (std::find(cubes.begin(), cubes.end(), next) == cubes.end()) cubes.push_back(next);
  }
  return polycube(cubes);
}

inline model::Expression grid_cuboid(Random& random, int d) {
  std::vector<double> size;
  for (int i = 0; i < d; ++i) size.push_back(pick(random, 1, 3));
  return model::cuboid(size, false);
}

enum class Kind : std::uint8_t {
  grid_boxes,  ///< cuboids and polycubes on the integer grid: everything touches
  solids       ///< all primitives; placed on the grid, or freely
};

inline model::Expression random_primitive(Random& random, int d, Kind kind) {
  if (kind == Kind::solids && chance(random, 0.2)) return model::simplex(d, pick(random, 1, 3));
  if (d != 3) return grid_cuboid(random, d);
  if (kind == Kind::grid_boxes)
    return chance(random, 0.2) ? random_polycube(random, pick(random, 2, 6)) : grid_cuboid(random, d);
  const auto sides = static_cast<std::uint32_t>(pick(random, 3, 8));
  switch (pick(random, 0, 7)) {
    case 0:
      return model::cylinder(pick(random, 1, 3), pick(random, 1, 2), pick(random, 0, 2), sides,
                             chance(random, 0.5));
    case 1:
      return model::cylinder(pick(random, 1, 3), 0, pick(random, 1, 2), sides, chance(random, 0.5));
    case 2:
      return model::sphere(pick(random, 1, 2), sides);
    case 3:
      return l_shape(pick(random, 1, 2), pick(random, 1, 2), pick(random, 1, 2));
    case 4:
      return star(pick(random, 3, 5), pick(random, 2, 3), 1, pick(random, 1, 2));
    case 5:
      return random_polycube(random, pick(random, 2, 5));
    default:
      return grid_cuboid(random, d);
  }
}

inline model::Expression random_expression(Random& random, int d, Kind kind, int depth) {
  if (depth == 0 || chance(random, 0.1)) {
    const bool grid = kind == Kind::grid_boxes || chance(random, 0.6);
    return model::transform(grid ? grid_matrix(random, d, 2) : free_matrix(random, d, 2),
                            random_primitive(random, d, kind));
  }
  if (chance(random, 0.1))
    return model::transform(grid_matrix(random, d, 1), random_expression(random, d, kind, depth - 1));
  if (chance(random, 0.07)) return model::complement(random_expression(random, d, kind, depth - 1));
  std::vector<model::Expression> operands;
  const int count = pick(random, 2, depth == 1 ? 4 : 3);
  for (int i = 0; i < count; ++i)
    operands.push_back(!operands.empty() && chance(random, 0.1)
                           ? operands.front()
                           : random_expression(random, d, kind, depth - 1));
  switch (pick(random, 0, 6)) {
    case 0:
    case 1:
    case 2:
      return model::unite(operands);
    case 3:
      return model::intersect(operands);
    case 4:
      return model::symmetric_difference(operands);
    default:
      return model::subtract(operands);
  }
}

// --- evaluating
// --------------------------------------------------------------------------------------------------

/// Keeps all batches.
class CollectingConsumer : public Consumer {
 public:
  void consume(const std::shared_ptr<const Refinement>& refinement) override {
    refinements.push_back(refinement);
  }
  std::vector<std::shared_ptr<const Refinement>> refinements;
};

template <int D>
struct Evaluated {
  Evaluation<D> evaluation;
  std::vector<std::shared_ptr<const Refinement>> refinements;
};

template <int D>
Evaluated<D> evaluate_all(const Network<D>& network, unsigned depth, const EvaluateOptions& options) {
  CollectingConsumer collector;
  std::vector<Consumer*> consumers{&collector};
  return {evaluate(network, partition(network, depth).regions, options, consumers),
          std::move(collector.refinements)};
}

inline EvaluateOptions keep_everything(unsigned threads = 1, Order order = Order::depth) {
  EvaluateOptions options;
  options.threads = threads;
  options.order = order;
  options.keep_out = true;
  return options;
}

/// Volume of the IN cells.
template <int D>
double volume(const model::Expression& e, double coincidence = 1e-9) {
  const Network<D> network = compile<D>(e, {.coincidence = coincidence});
  EvaluateOptions options;
  return evaluate(network, partition(network, 0).regions, options, {}).totals.in.value().volume();
}

}  // namespace bsp2::dataflow
