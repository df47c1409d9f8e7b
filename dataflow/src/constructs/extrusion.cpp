#include "constructs/extrusion.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"

namespace bsp2::dataflow {
namespace {

using model::cosine;
using model::Expression;
using model::LinearExtrusion;
using model::sine;
using Point = std::array<double, 2>;

/// Each slice costs about half a millisecond: what is more than this is nearly always a slip.
constexpr std::uint64_t most_slice_edges = 1'000'000;

/// Length of the spiral r = a * angle from 0 to `angle`.
double spiral_length(double a, double angle) {
  return a / 2 * (angle * std::sqrt(1 + angle * angle) + std::asinh(angle));
}

/// Slices that a twist asks for: OpenSCAD's length of the (conical) helix of the outermost corner over $fs.
double twist_slices(const LinearExtrusion& e, double height, double radius) {
  const double degrees = std::fabs(e.twist), least = std::max(std::ceil(degrees / 120), 1.0);
  if (e.resolution.fn > 0) return std::max(std::ceil(degrees / 360 * e.resolution.fn), least);
  const double turn = degrees * std::numbers::pi / 180, s = e.scale[0];
  double along = turn * radius;
  if (e.scale[0] == e.scale[1] && s != 1) {
    const double end = s > 1 ? turn * s / (s - 1) : turn / (1 - s);
    along = spiral_length(radius / end, end) - spiral_length(radius / end, end - turn);
  }
  const double by_angle = std::ceil(degrees / std::max(e.resolution.fa, 0.01));
  return std::max(std::min(by_angle, std::ceil(std::hypot(along, height) / std::max(e.resolution.fs, 0.01))),
                  least);
}

/// Whether scaling keeps all sides planar: edges along an axis stay parallel to themselves.
bool has_edges_along_axes_only(const Outline& outline) {
  for (const auto& path : outline)
    for (std::size_t i = 0; i < path.size(); ++i) {
      const auto &p = path[i], &q = path[(i + 1) % path.size()];
      const double dx = std::fabs(q[0] - p[0]), dy = std::fabs(q[1] - p[1]);
      if (std::min(dx, dy) > 1e-12 * std::max(dx, dy)) return false;
    }
  return true;
}

std::uint32_t slice_count(const LinearExtrusion& e, const Outline& outline) {
  if (e.twist == 0 && has_edges_along_axes_only(outline)) return 1;  // more would cut planes into slices
  if (e.slices > 0) return e.slices;
  const double height = std::hypot(e.direction[0], e.direction[1], e.direction[2]);
  double radius = 0, shift = 0;
  for (const auto& path : outline)
    for (const auto& p : path) {
      radius = std::max(radius, std::hypot(p[0], p[1]));
      shift = std::max(shift, std::hypot(p[0] * (1 - e.scale[0]), p[1] * (1 - e.scale[1])));
    }
  double slices = e.twist != 0 ? twist_slices(e, height, radius) : 1;
  if (e.scale[0] != e.scale[1])
    slices = std::max(slices, e.resolution.fn > 0
                                  ? std::trunc(e.resolution.fn)
                                  : std::ceil(std::hypot(shift, height) / std::max(e.resolution.fs, 0.01)));
  if (!(slices <= model::max_sides))
    throw Error("linear_extrude: more than " + std::to_string(model::max_sides) +
                " slices; give slices or a larger $fs");
  return static_cast<std::uint32_t>(std::max(slices, 1.0));
}

/// Whether the last slice ends in a line.
bool flattens_to_a_line(const LinearExtrusion& e) { return (e.scale[0] == 0) != (e.scale[1] == 0); }

/// Which diagonal OpenSCAD 2021.01 takes for the side between an edge of the outline, p1 to q1, and its copy
/// above, p2 to q2: the shorter one, and the longer one below a slice that is flattened to a line.
class Diagonals {
 public:
  Diagonals(const LinearExtrusion& extrusion, bool is_hole, bool is_last_slice)
      : first_of_equals_((extrusion.twist > 0) != is_hole),
        takes_longer_(is_last_slice && flattens_to_a_line(extrusion)) {}

  /// Whether it is that from p1 to q2.
  [[nodiscard]] bool is_first(const Point& p1, const Point& q1, const Point& p2, const Point& q2) const {
    return is_preferred(length(p1, q2), length(q1, p2)) != takes_longer_;
  }

 private:
  bool first_of_equals_, takes_longer_;

  static double length(const Point& from, const Point& to) {
    return std::hypot(to[0] - from[0], to[1] - from[1]);
  }

  [[nodiscard]] bool is_preferred(double first, double second) const {
    const bool are_equal = 2e5 * std::fabs(first - second) <= first + second;  // ten parts in a million
    return are_equal ? first_of_equals_ : first < second;
  }
};

/// @param width lengths along x and y per unit of the frame.
Expression placed(const LinearExtrusion& e, double width, Expression unit) {
  const auto& d = e.direction;
  const double back = e.center ? 0.5 : 0;
  const double matrix[] = {width, 0, d[0], -back * d[0], 0, width, d[1], -back * d[1],
                           0,     0, d[2], -back * d[2], 0, 0,     0,    1};
  return model::transform(matrix, std::move(unit));
}

}  // namespace

namespace {

bool is_convex_path(const std::vector<Point>& path) {
  const Expression hull = model::convex_hull(path);
  const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
  if (primitive == nullptr) return false;
  const double area = signed_area(path);
  return std::fabs(signed_area(std::get<model::ConvexPolygon>(*primitive).points) - area) <= 1e-9 * area;
}

/// The grid of the corners of all slices: multiples of 2^-51 of the unit of their frame, which each slice
/// holds exactly in a frame of its own; or none, where what differs by rounding is merged.
class Grid {
 public:
  explicit Grid(bool is_there) : is_there_(is_there) {}
  [[nodiscard]] bool is_there() const { return is_there_; }
  [[nodiscard]] std::array<double, 3> snapped(std::array<double, 3> p) const {
    if (is_there_)
      for (double& x : p) x = std::nearbyint(x * 0x1p51) * 0x1p-51;
    return p;
  }

 private:
  bool is_there_;
};

/// The power of two that is next below the reach of the outline along x and y, above and below: with it as
/// their unit, slices lose no more than others where the outline is tiny, or huge, against their height.
double width_of(const LinearExtrusion& e, const Outline& outline) {
  double reach = 0;
  for (const auto& path : outline)
    for (const Point& p : path)
      reach = std::max(reach, std::hypot(p[0], p[1]) * std::max({1.0, e.scale[0], e.scale[1]}));
  return reach > 0 ? std::ldexp(1.0, std::ilogb(reach)) : 1;
}

Outline in_units_of(double width, Outline outline) {
  for (auto& path : outline)
    for (Point& p : path) p = {p[0] / width, p[1] / width};
  return outline;
}

double signed_volume(const std::vector<std::array<double, 3>>& points,
                     const std::array<std::uint32_t, 3>& triangle) {
  const auto &a = points[triangle[0]], &b = points[triangle[1]], &c = points[triangle[2]];
  return (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
          a[2] * (b[0] * c[1] - b[1] * c[0])) /
         6;
}

/// The hull of points if it has no more volume than what their faces bound, so that these only have creases
/// of rounding.
std::optional<Expression> hull_without_creases(const std::vector<std::array<double, 3>>& points,
                                               const std::vector<std::vector<std::uint32_t>>& faces) {
  double volume = 0;
  for (const auto& face : faces)  // clockwise
    for (std::size_t i = 1; i + 1 < face.size(); ++i)
      volume += signed_volume(points, {face[0], face[i + 1], face[i]});
  Expression hull = model::convex_hull(points);
  const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
  if (primitive == nullptr) return std::nullopt;
  const auto& mesh = std::get<model::TriangleMesh>(*primitive);
  double hull_volume = 0;
  for (const auto& triangle : mesh.triangles) hull_volume += signed_volume(mesh.points, triangle);
  if (!(hull_volume <= volume * (1 + 1e-12))) return std::nullopt;
  return hull;
}

Expression twisted_slice(const LinearExtrusion& e, const Outline& outline, std::uint32_t slice,
                         std::uint32_t slices, const Grid& grid) {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<std::uint32_t>> faces;  // clockwise seen from outside
  for (const auto& path : outline) {
    const auto n = static_cast<std::uint32_t>(path.size()), first = static_cast<std::uint32_t>(points.size());
    for (std::uint32_t j = slice; j <= slice + 1; ++j) {
      const double t = static_cast<double>(j) / slices, c = cosine(-e.twist * t), s = sine(-e.twist * t);
      for (const auto& p : path)
        points.push_back(grid.snapped({(1 - (1 - e.scale[0]) * t) * (c * p[0] - s * p[1]),
                                       (1 - (1 - e.scale[1]) * t) * (s * p[0] + c * p[1]), t}));
    }
    std::vector<std::uint32_t> bottom, top;
    for (std::uint32_t i = 0; i < n; ++i) {
      bottom.push_back(first + i);
      top.push_back(first + 2 * n - 1 - i);
    }
    faces.push_back(std::move(bottom));
    faces.push_back(std::move(top));
    const auto at = [&](std::uint32_t i) { return Point{points[i][0], points[i][1]}; };
    const Diagonals diagonals(e, signed_area(path) < 0, slice + 1 == slices);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t p1 = first + i, q1 = first + (i + 1) % n, p2 = p1 + n, q2 = q1 + n;
      if (diagonals.is_first(at(p1), at(q1), at(p2), at(q2))) {
        faces.push_back({p1, q2, q1});
        faces.push_back({p1, p2, q2});
      } else {
        faces.push_back({p1, p2, q1});
        faces.push_back({p2, q2, q1});
      }
    }
  }
  if (grid.is_there() && outline.size() == 1)
    if (auto hull = hull_without_creases(points, faces)) return *std::move(hull);
  return model::polyhedron(points, faces);
}

/// Slices of a scaled convex outline: convex but for the tetrahedra that the shorter diagonals cut off.
Expression extrude_convex(const LinearExtrusion& e, const Outline& outline, std::uint32_t slices,
                          const Grid& grid) {
  const std::vector<Point>& path = outline[0];
  const auto n = path.size();
  std::vector<Expression> all;
  const auto at = [&](std::size_t i, std::uint32_t j) {
    const double t = static_cast<double>(j) / slices;
    return grid.snapped(
        {(1 - (1 - e.scale[0]) * t) * path[i % n][0], (1 - (1 - e.scale[1]) * t) * path[i % n][1], t});
  };
  for (std::uint32_t j = 0; j < slices; ++j) {
    if (j + 1 == slices && flattens_to_a_line(e)) {  // its sides meet inside of the hull
      all.push_back(twisted_slice(e, outline, j, slices, grid));
      continue;
    }
    std::vector<std::array<double, 3>> corners;
    for (std::size_t i = 0; i < n; ++i) corners.insert(corners.end(), {at(i, j), at(i, j + 1)});
    std::vector<Expression> slab{model::convex_hull(corners)};
    const Diagonals diagonals(e, false, j + 1 == slices);
    for (std::size_t i = 0; i < n; ++i) {
      const auto p1 = at(i, j), q1 = at(i + 1, j), p2 = at(i, j + 1), q2 = at(i + 1, j + 1);
      const bool first = diagonals.is_first({p1[0], p1[1]}, {q1[0], q1[1]}, {p2[0], p2[1]}, {q2[0], q2[1]});
      // The two triangles along p1 q2 bulge if p2 lies behind the plane of p1 q1 q2.
      const double ux = q1[0] - p1[0], uy = q1[1] - p1[1], vx = q2[0] - p2[0], vy = q2[1] - p2[1];
      const double bulge = ux * vy - uy * vx;  // > 0: the upper edge is turned to the left
      if (std::fabs(bulge) <= 1e-12 * std::hypot(ux, uy) * std::hypot(vx, vy))
        continue;  // plane but for rounding
      if (first ? bulge > 0 : bulge < 0) slab.push_back(model::convex_hull({p1, q1, p2, q2}));
    }
    all.push_back(slab.size() == 1 ? slab[0] : model::subtract(std::move(slab)));
  }
  return all.size() == 1 ? all[0] : model::unite(std::move(all));
}

}  // namespace

Expression extrude_outline(const LinearExtrusion& e, const Outline& given, double coincidence) {
  const std::uint32_t slices = slice_count(e, given);
  const Grid grid(coincidence < outline_coincidence);
  const double width = grid.is_there() ? width_of(e, given) : 1;
  const Outline outline = in_units_of(width, given);
  if (e.twist == 0 && outline.size() == 1 && is_convex_path(outline[0]))
    return placed(e, width, extrude_convex(e, outline, slices, grid));
  std::uint64_t edges = 0;
  for (const auto& path : outline) edges += path.size();
  if (slices * edges > most_slice_edges)
    throw Error("linear_extrude: the number of slices is " + std::to_string(slices) +
                ", the number of edges in each " + std::to_string(edges) + "; the limit is " +
                std::to_string(most_slice_edges) + " edges in all: give fewer slices or a larger $fs");
  // A mesh for each slice: it costs caps, but the mesh that a cell has to look at is small.
  std::vector<Expression> all;
  for (std::uint32_t j = 0; j < slices; ++j) all.push_back(twisted_slice(e, outline, j, slices, grid));
  return placed(e, width, all.size() == 1 ? all[0] : model::unite(std::move(all)));
}

namespace {

/// The cone between an edge and the axis, as part of a turn of at most 180 degrees, or as a whole one (angle
/// = 360).
Expression cone(const Point& low, const Point& high, double start, double angle, std::uint32_t segments,
                double coincidence) {
  // Its end is high[1] to the last bit only if that is not a sum; it matters where nothing is merged.
  if (angle == 360 && coincidence < outline_coincidence)
    return Expression(
        std::make_shared<model::Node>(3, model::Lathe{segments, {{low[0], low[1]}, {high[0], high[1]}}}));
  if (angle == 360) {
    const double shift[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, low[1], 0, 0, 0, 1};
    return model::transform(shift, model::cylinder(high[1] - low[1], low[0], high[0], segments));
  }
  std::vector<std::array<double, 3>> points{{0, 0, low[1]}, {0, 0, high[1]}};
  for (std::uint32_t j = 0; j <= segments; ++j) {
    const double at = start + angle * j / segments, c = cosine(at), s = sine(at);
    for (const Point& p : {low, high}) points.push_back({p[0] * c, p[0] * s, p[1]});
  }
  return model::convex_hull(points);
}

}  // namespace

namespace {

/// The outline with edges that are horizontal, or on the axis, but for the rounding of its corners made so:
/// their cones would have no thickness.
Outline straightened(Outline outline) {
  double reach = 0;
  for (const auto& path : outline)
    for (const Point& p : path) reach = std::max({reach, std::fabs(p[0]), std::fabs(p[1])});
  const double rounding = reach * 0x1p-46;
  for (auto& path : outline) {
    const std::size_t n = path.size();
    const auto is_level = [&](std::size_t i) {
      return std::fabs(path[(i + 1) % n][1] - path[i % n][1]) <= rounding;
    };
    std::size_t first = 0;  // the end of an edge that is not horizontal, so that no run of horizontal ones
                            // goes past the end of the path
    while (first < n && is_level(first)) ++first;
    if (first == n) continue;
    for (std::size_t i = first + 1; i < first + n; ++i)
      if (is_level(i)) path[(i + 1) % n][1] = path[i % n][1];
    std::vector<bool> on_axis(n);
    for (std::size_t i = 0; i < n; ++i)
      if (std::max(path[i][0], path[(i + 1) % n][0]) <= rounding) on_axis[i] = on_axis[(i + 1) % n] = true;
    for (std::size_t i = 0; i < n; ++i)
      if (on_axis[i]) path[i][0] = 0;
  }
  return outline;
}

}  // namespace

Expression revolve_outline(const Outline& given, double start, double angle, std::uint32_t segments,
                           double coincidence) {
  std::uint64_t edges = 0;
  for (const auto& path : given) edges += path.size();
  if (edges * segments > model::max_sphere_facets)
    throw Error("rotate_extrude: " + counted(segments, "# segment[s] of ") + counted(edges, "# edge[s]") +
                "; the limit is " + grouped(model::max_sphere_facets) +
                " facets in all: give a larger $fs or a smaller $fn");
  const Outline outline = straightened(given);
  // Parts of a turn are convex up to 180 degrees. A whole turn with less than three segments is flat.
  struct Sector {
    double start, angle;
    std::uint32_t segments;
  };
  std::vector<Sector> sectors;
  if (angle == 360) {
    if (segments < 3) return Expression(3);
    sectors = {{0, 360, segments}};
  } else {
    // At most all of them, also where the angle is so small that the quotient is infinite.
    const auto most = static_cast<std::uint32_t>(std::clamp(
        std::floor(180 / std::fabs(angle) * segments), 1.0, std::max(1.0, static_cast<double>(segments))));
    for (std::uint32_t j = 0; j < segments; j += most) {
      const std::uint32_t count = std::min(most, segments - j);
      sectors.push_back({start + angle * j / segments, angle * count / segments, count});
    }
  }
  std::vector<Expression> cones;
  for (const auto& path : outline)
    for (std::size_t i = 0; i < path.size(); ++i) {
      Point p = path[i], q = path[(i + 1) % path.size()];
      if (p[1] == q[1] || (p[0] == 0 && q[0] == 0)) continue;
      if (p[1] > q[1]) std::swap(p, q);
      for (const Sector& sector : sectors)
        cones.push_back(cone(p, q, sector.start, sector.angle, sector.segments, coincidence));
    }
  if (cones.empty()) return Expression(3);
  Expression solid = cones.size() == 1 ? cones[0] : model::symmetric_difference(std::move(cones));
  if (angle != 360 || start == 0) return solid;
  const double c = cosine(start), s = sine(start);
  const double turn[] = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  return model::transform(turn, std::move(solid));
}

}  // namespace bsp2::dataflow
