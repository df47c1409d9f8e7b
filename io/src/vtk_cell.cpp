#include "vtk_cell.hpp"

#include <vtkCellType.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>

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

Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

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

/// The vertex on the most facets: cutting from there gives the fewest simplices.
std::uint16_t busiest_vertex(const CellBatch& batch, std::size_t cell) {
  std::vector<int> uses(batch.point_count(cell));
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    for (const std::uint16_t vertex : batch.vertices_of_facet(f)) ++uses[vertex];
  }
  return static_cast<std::uint16_t>(std::max_element(uses.begin(), uses.end()) - uses.begin());
}

void cut_3d(const CellBatch& batch, std::size_t cell, std::vector<Simplex>& result) {
  const std::uint16_t apex = busiest_vertex(batch, cell);
  const Point top = point_of(batch, cell, apex);
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const Vertices around = batch.vertices_of_facet(f);
    if (contains(around, apex)) continue;
    const Point a = minus(point_of(batch, cell, around[0]), top);
    for (std::size_t i = 2; i < around.size(); ++i) {
      const Point b = minus(point_of(batch, cell, around[i - 1]), top),
                  c = minus(point_of(batch, cell, around[i]), top);
      const double volume = determinant(a, b, c) / 6;
      if (volume > 0) result.push_back({{around[0], around[i], around[i - 1], apex}, volume});
    }
  }
}

void cut_2d(const CellBatch& batch, std::size_t cell, std::vector<Simplex>& result) {
  std::vector<std::uint16_t> around;
  go_around(batch, cell, around);
  const Point origin = point_of(batch, cell, around[0]);
  for (std::size_t i = 2; i < around.size(); ++i) {
    const Point a = minus(point_of(batch, cell, around[i - 1]), origin),
                b = minus(point_of(batch, cell, around[i]), origin);
    const double area = (a[0] * b[1] - a[1] * b[0]) / 2;
    if (area > 0) result.push_back({{around[0], around[i - 1], around[i], 0}, area});
  }
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

void cut_into_simplices(const CellBatch& batch, std::size_t cell, std::vector<Simplex>& result) {
  result.clear();
  if (batch.dimension == 3) {
    cut_3d(batch, cell, result);
  } else {
    cut_2d(batch, cell, result);
  }
}

}  // namespace bsp2::io
