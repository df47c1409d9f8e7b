#include "vtk/vtk_cell.hpp"

#include <vtkCellType.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>

#include "bsp2/geometry/support/vectors.hpp"
#include "outputs/orientation.hpp"

namespace bsp2::io {
namespace {

using geometry::CellBatch;
using Vertices = std::span<const std::uint16_t>;
using Point = std::array<double, 3>;

Point point_of(const CellBatch& batch, std::size_t cell, std::uint16_t vertex) {
  Point p{};
  const auto d = static_cast<std::size_t>(batch.dimension);
  std::copy_n(batch.cell_points(cell).data() + vertex * d, d, p.begin());
  return p;
}

using geometry::cross;
using geometry::dot;
using geometry::minus;

double determinant(const Point& a, const Point& b, const Point& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// The first facet of a cell with `count` vertices.
Vertices facet_with(const CellBatch& batch, std::size_t cell, std::size_t count) {
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    if (batch.vertices_of_facet(f).size() == count) return batch.vertices_of_facet(f);
  }
  return {};
}

/// Number of facets of a cell with `count` vertices.
std::size_t facets_with(const CellBatch& batch, std::size_t cell, std::size_t count) {
  std::size_t found = 0;
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    found += batch.vertices_of_facet(f).size() == count;
  }
  return found;
}

bool contains(Vertices vertices, std::uint16_t vertex) {
  return std::find(vertices.begin(), vertices.end(), vertex) != vertices.end();
}

/// The vertex outside `base` to which an edge leads from `vertex`, which is in `base`; in a prism there is
/// one.
std::optional<std::uint16_t> partner(const CellBatch& batch, std::size_t cell, Vertices base,
                                     std::uint16_t vertex) {
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const Vertices around = batch.vertices_of_facet(f);
    for (std::size_t i = 0; i < around.size(); ++i) {
      const std::uint16_t next = around[(i + 1) % around.size()];
      if (around[i] == vertex && !contains(base, next)) return next;
    }
  }
  return std::nullopt;
}

/// A prism: the base, then above each of its vertices the partner. False if the cell, thinner than its
/// coordinates are exact, goes around its facets in other ways.
bool set_prism(const CellBatch& batch, std::size_t cell, Vertices base, std::vector<std::uint16_t>& points) {
  points.assign(base.begin(), base.end());
  for (const std::uint16_t vertex : base) {
    const auto above = partner(batch, cell, base, vertex);
    if (!above || (base.size() * 2 == batch.point_count(cell) && contains(points, *above))) return false;
    points.push_back(*above);
  }
  return true;
}

void describe_3d(const CellBatch& batch, std::size_t cell, VtkCell& result) {
  const std::size_t points = batch.point_count(cell), facets = batch.facet_count(cell);
  if (points == 4 && facets == 4 && set_prism(batch, cell, facet_with(batch, cell, 3), result.points)) {
    // VTK wants the first three points around a normal that shows *to* the fourth: the facet reversed.
    result.type = VTK_TETRA;
    result.points.resize(4);
    std::swap(result.points[0], result.points[1]);
  } else if (points == 6 && facets == 5 && facets_with(batch, cell, 3) == 2 &&
             set_prism(batch, cell, facet_with(batch, cell, 3), result.points)) {
    result.type = VTK_WEDGE;  // here the normal of the first three shows outward
  } else if (points == 8 && facets == 6 && facets_with(batch, cell, 4) == 6 &&
             set_prism(batch, cell, facet_with(batch, cell, 4), result.points)) {
    result.type = VTK_HEXAHEDRON;  // as with the tetrahedron
    std::swap(result.points[1], result.points[3]);
    std::swap(result.points[5], result.points[7]);
  } else {
    result.type = VTK_POLYHEDRON;
    result.points.resize(points);
    std::iota(result.points.begin(), result.points.end(), std::uint16_t{0});
  }
}

/// The vertices of a 2D cell in counter-clockwise order, from its edges, whose own order means nothing.
void go_around(const CellBatch& batch, std::size_t cell, std::vector<std::uint16_t>& points) {
  const std::size_t first = batch.facet_offset[cell], count = batch.facet_count(cell);
  std::vector<std::array<int, 2>> neighbours(batch.point_count(cell), {-1, -1});
  for (std::size_t f = first; f < first + count; ++f) {
    const Vertices edge = batch.vertices_of_facet(f);
    for (const int end : {0, 1}) neighbours[edge[end]][neighbours[edge[end]][0] >= 0] = edge[1 - end];
  }
  points.assign(1, batch.vertices_of_facet(first)[0]);
  for (int before = -1; points.size() < count;) {
    const std::uint16_t at = points.back();
    const int next = neighbours[at][0] == before ? neighbours[at][1] : neighbours[at][0];
    if (next < 0) throw std::logic_error("the edges of a cell do not close");
    points.push_back(static_cast<std::uint16_t>(next));
    before = at;
  }
  const Point origin = point_of(batch, cell, points[0]);
  double twice_area = 0;
  for (std::size_t i = 2; i < points.size(); ++i) {
    const Point a = minus(point_of(batch, cell, points[i - 1]), origin);
    const Point b = minus(point_of(batch, cell, points[i]), origin);
    twice_area += a[0] * b[1] - a[1] * b[0];
  }
  if (twice_area < 0) std::reverse(points.begin(), points.end());
}

/// The vertices, those on the most facets first: cutting from there gives the fewest simplices.
std::vector<std::uint16_t> busiest_first(const CellBatch& batch, std::size_t cell) {
  std::vector<int> uses(batch.point_count(cell));
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    for (const std::uint16_t vertex : batch.vertices_of_facet(f)) ++uses[vertex];
  }
  std::vector<std::uint16_t> order(uses.size());
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint16_t a, std::uint16_t b) { return uses[a] > uses[b]; });
  return order;
}

/// What a triangle of a polygon adds: a simplex, if it has content. Asked for the corners, counter-clockwise.
using SimplexOf = std::function<std::optional<Simplex>(std::uint16_t, std::uint16_t, std::uint16_t)>;

/// All triangles around one corner of a polygon, appended if each is a simplex.
bool cut_as_fan(Vertices around, std::size_t first, const SimplexOf& simplex_of,
                std::vector<Simplex>& result) {
  const std::size_t before = result.size(), n = around.size();
  for (std::size_t i = 2; i < n; ++i) {
    const auto simplex = simplex_of(around[first], around[(first + i - 1) % n], around[(first + i) % n]);
    if (!simplex) {
      result.resize(before);
      return false;
    }
    result.push_back(*simplex);
  }
  return true;
}

/// Cuts off the corner that gives the largest simplex, again and again; what is left when none does is left
/// out.
void cut_off_corners(Vertices around, const SimplexOf& simplex_of, std::vector<Simplex>& result) {
  std::vector<std::uint16_t> rest(around.begin(), around.end());
  while (rest.size() > 2) {
    std::optional<Simplex> best;
    std::size_t corner = 0;
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const auto simplex =
          simplex_of(rest[(i + rest.size() - 1) % rest.size()], rest[i], rest[(i + 1) % rest.size()]);
      if (!simplex || (best && best->volume >= simplex->volume)) continue;
      best = simplex;
      corner = i;
    }
    if (!best) return;
    result.push_back(*best);
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(corner));
  }
}

/// A polygon as simplices: as a fan around its first corner, or around another one, or as it can be. @return
/// whether all of it is.
bool cut_polygon(Vertices around, const SimplexOf& simplex_of, std::vector<Simplex>& result) {
  for (std::size_t first = 0; first < around.size(); ++first)
    if (cut_as_fan(around, first, simplex_of, result)) return true;
  const std::size_t before = result.size();
  cut_off_corners(around, simplex_of, result);
  return result.size() == before + around.size() - 2;
}

/// A tetrahedron around which everybody agrees that it is not inverted and not flat: the exact sign of its
/// volume says so, and doubles do, whichever of its corners they begin with. @param a, b, c counter-clockwise
/// seen from outside.
std::optional<Simplex> tetrahedron(const CellBatch& batch, std::size_t cell, std::uint16_t a, std::uint16_t b,
                                   std::uint16_t c, std::uint16_t apex) {
  const std::array<Point, 4> p{point_of(batch, cell, a), point_of(batch, cell, c), point_of(batch, cell, b),
                               point_of(batch, cell, apex)};
  const double volume = determinant(minus(p[0], p[3]), minus(p[2], p[3]), minus(p[1], p[3])) / 6;
  // As VTK counts the corners, the fourth is where the first three are counter-clockwise.
  if (!(volume > 0) || orientation(p[0], p[1], p[2], p[3]) <= 0) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) {
    std::array<Point, 3> edges;
    for (std::size_t k = 0; k < 3; ++k) edges[k] = minus(p[(i + k + 1) % 4], p[i]);
    if (!((i % 2 == 0 ? 1 : -1) * determinant(edges[0], edges[1], edges[2]) > 0)) return std::nullopt;
  }
  return Simplex{{a, c, b, apex}, volume};
}

/// Around one corner. @return whether nothing is left out.
bool cut_3d_from(const CellBatch& batch, std::size_t cell, std::uint16_t apex, std::vector<Simplex>& result) {
  const SimplexOf simplex_of = [&](std::uint16_t a, std::uint16_t b, std::uint16_t c) {
    return tetrahedron(batch, cell, a, b, c, apex);
  };
  bool is_whole = true;
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const Vertices around = batch.vertices_of_facet(f);
    if (!contains(around, apex)) is_whole = cut_polygon(around, simplex_of, result) && is_whole;
  }
  return is_whole;
}

double volume_of(const std::vector<Simplex>& simplices) {
  return std::accumulate(simplices.begin(), simplices.end(), 0.0,
                         [](double sum, const Simplex& simplex) { return sum + simplex.volume; });
}

bool cut_3d(const CellBatch& batch, std::size_t cell, std::vector<Simplex>& result) {
  std::vector<Simplex> other;
  for (const std::uint16_t apex : busiest_first(batch, cell)) {
    other.clear();
    const bool is_whole = cut_3d_from(batch, cell, apex, other);
    if (is_whole || volume_of(other) > volume_of(result)) result.swap(other);
    if (is_whole) return true;
  }
  return false;
}

bool cut_2d(const CellBatch& batch, std::size_t cell, std::vector<Simplex>& result) {
  std::vector<std::uint16_t> around;
  go_around(batch, cell, around);
  return cut_polygon(
      around,
      [&](std::uint16_t a, std::uint16_t b, std::uint16_t c) -> std::optional<Simplex> {
        const std::array<Point, 3> p{point_of(batch, cell, a), point_of(batch, cell, b),
                                     point_of(batch, cell, c)};
        std::array<double, 3> twice;  // the area, from each corner
        for (std::size_t i = 0; i < 3; ++i) {
          const Point u = minus(p[(i + 1) % 3], p[i]), v = minus(p[(i + 2) % 3], p[i]);
          twice[i] = u[0] * v[1] - u[1] * v[0];
        }
        // Over the plane, a triangle is as a tetrahedron is with a corner above it.
        const Point above{p[0][0], p[0][1], 1};
        if (!(*std::min_element(twice.begin(), twice.end()) > 0) || orientation(p[0], p[1], p[2], above) <= 0)
          return std::nullopt;
        return Simplex{{a, b, c, 0}, twice[0] / 2};
      },
      result);
}

/// The angle at a, in degrees, of the triangle a b c.
double angle_at(const Point& a, const Point& b, const Point& c) {
  const Point u = minus(b, a), v = minus(c, a), n = cross(u, v);
  return std::atan2(std::sqrt(dot(n, n)), dot(u, v)) * 180 / std::numbers::pi;
}

/// The angle between the two faces of a tetrahedron at its edge a b, in degrees. @param volume of the
/// tetrahedron: how far the normals of the faces are from each other, which they are too rough to tell of
/// slivers.
double dihedral_angle(const Point& a, const Point& b, const Point& c, const Point& d, double volume) {
  const Point edge = minus(b, a), m = cross(edge, minus(c, a)), n = cross(edge, minus(d, a));
  return std::atan2(6 * volume * std::sqrt(dot(edge, edge)), dot(m, n)) * 180 / std::numbers::pi;
}

}  // namespace

void describe(const CellBatch& batch, std::size_t cell, VtkCell& result) {
  if (batch.dimension == 3) {
    describe_3d(batch, cell, result);
  } else if (batch.dimension == 2) {
    result.type = VTK_POLYGON;
    go_around(batch, cell, result.points);
  } else {
    result.type = VTK_LINE;
    result.points = {0, 1};
  }
}

bool cut_into_simplices(const CellBatch& batch, std::size_t cell, std::vector<Simplex>& result) {
  result.clear();
  return batch.dimension == 3 ? cut_3d(batch, cell, result) : cut_2d(batch, cell, result);
}

double smallest_angle(const CellBatch& batch, std::size_t cell, const Simplex& simplex) {
  std::array<Point, 4> p;
  for (std::size_t i = 0; i < 4; ++i) p[i] = point_of(batch, cell, simplex.points[i]);
  if (batch.dimension == 2)
    return std::min({angle_at(p[0], p[1], p[2]), angle_at(p[1], p[2], p[0]), angle_at(p[2], p[0], p[1])});
  double least = 180;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = i + 1; k < 4; ++k) {
      const std::size_t l = i != 0 ? 0 : k != 1 ? 1 : 2, m = 6 - i - k - l;  // the other two
      least = std::min(least, dihedral_angle(p[i], p[k], p[l], p[m], simplex.volume));
    }
  return least;
}

}  // namespace bsp2::io
