#include "support/sample_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <queue>

namespace bsp2::samples {
namespace {

using geometry::CellBatch;

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double distance(const std::array<double, 4>& plane, const Point& p) {
  return plane[0] + plane[1] * p[0] + plane[2] * p[1] + plane[3] * p[2];
}

/// Where the plane cuts an edge: bitwise the same whichever way the edge is walked.
Point cut(const std::array<double, 4>& plane, Point a, Point b) {
  if (b < a) std::swap(a, b);
  const double da = distance(plane, a), db = distance(plane, b), t = da / (da - db);
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

/// Turns facets outward.
Polyhedron oriented(Polyhedron solid) {
  Point center{};
  double count = 0;
  for (const auto& facet : solid.facets) {
    for (const Point& p : facet) {
      for (int i = 0; i < 3; ++i) center[i] += p[i];
      ++count;
    }
  }
  for (double& x : center) x /= count;
  for (auto& facet : solid.facets) {
    if (dot(cross(facet[1] - facet[0], facet[2] - facet[0]), facet[0] - center) < 0)
      std::reverse(facet.begin(), facet.end());
  }
  return solid;
}

/// The facet on the plane, from the points on it in any order.
std::vector<Point> cap(std::vector<Point> points, const Point& normal) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  Point center{};
  for (const Point& p : points) {
    for (int i = 0; i < 3; ++i) center[i] += p[i] / static_cast<double>(points.size());
  }
  const Point u = points.front() - center, v = cross(normal, u);
  const auto angle = [&](const Point& p) { return std::atan2(dot(p - center, v), dot(p - center, u)); };
  std::sort(points.begin(), points.end(),
            [&](const Point& a, const Point& b) { return angle(a) < angle(b); });
  return points;
}

void finish_cell(CellBatch& batch, double volume, geometry::Label label, std::int32_t part) {
  batch.point_offset.push_back(
      static_cast<std::uint32_t>(batch.points.size() / static_cast<std::size_t>(batch.dimension)));
  batch.facet_offset.push_back(static_cast<std::uint32_t>(batch.facet_vertex_offset.size() - 1));
  batch.label.push_back(label);
  batch.primitive.push_back(part);  // what a test does not care to tell apart
  batch.part.push_back(part);
  batch.region.push_back(static_cast<std::uint32_t>(batch.size() % 3));
  batch.level.push_back(7);
  batch.volume.push_back(volume);
}

void finish_facet(CellBatch& batch) {
  batch.facet_vertex_offset.push_back(static_cast<std::uint32_t>(batch.facet_vertices.size()));
  batch.facet_hyperplane.push_back(0);
}

}  // namespace

Polyhedron box(const Point& low, const Point& high) {
  const auto corner = [&](int i) {
    return Point{i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]};
  };
  Polyhedron solid;
  for (const auto& f :
       {std::array{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}) {
    solid.facets.push_back({corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3])});
  }
  return oriented(solid);
}

Polyhedron tetrahedron(const Point& a, const Point& b, const Point& c, const Point& d) {
  return oriented({{{a, b, c}, {a, b, d}, {a, c, d}, {b, c, d}}});
}

Polyhedron wedge(const Point& a, const Point& b, const Point& c, const Point& up) {
  const auto lift = [&](const Point& p) { return Point{p[0] + up[0], p[1] + up[1], p[2] + up[2]}; };
  const Point d = lift(a), e = lift(b), f = lift(c);
  return oriented({{{a, b, e, d}, {a, b, c}, {b, c, f, e}, {d, e, f}, {c, a, d, f}}});
}

double volume(const Polyhedron& solid) {
  double six = 0;
  const Point origin = solid.facets[0][0];
  for (const auto& facet : solid.facets) {
    for (std::size_t i = 2; i < facet.size(); ++i) {
      six += dot(facet[0] - origin, cross(facet[i - 1] - origin, facet[i] - origin));
    }
  }
  return six / 6;
}

std::array<Polyhedron, 2> split(const Polyhedron& solid, const std::array<double, 4>& plane) {
  std::array<Polyhedron, 2> parts;
  std::vector<Point> on_plane;
  for (const auto& facet : solid.facets) {
    std::array<std::vector<Point>, 2> loops;
    for (std::size_t i = 0; i < facet.size(); ++i) {
      const Point &p = facet[i], &q = facet[(i + 1) % facet.size()];
      const bool p_side = distance(plane, p) > 0, q_side = distance(plane, q) > 0;
      loops[p_side].push_back(p);
      if (p_side == q_side) continue;
      const Point x = cut(plane, p, q);
      for (auto& loop : loops) loop.push_back(x);
      on_plane.push_back(x);
    }
    for (const int side : {0, 1}) {
      if (!loops[side].empty()) parts[side].facets.push_back(loops[side]);
    }
  }
  if (on_plane.empty()) return parts;
  const std::vector<Point> lid = cap(on_plane, {plane[1], plane[2], plane[3]});
  parts[0].facets.push_back(lid);
  parts[1].facets.emplace_back(lid.rbegin(), lid.rend());
  return parts;
}

void append(CellBatch& batch, const Polyhedron& solid, geometry::Label label, std::int32_t part) {
  std::map<Point, std::uint16_t> ids;
  for (const auto& facet : solid.facets) {
    for (const Point& p : facet) {
      const auto [found, is_new] = ids.try_emplace(p, static_cast<std::uint16_t>(ids.size()));
      if (is_new) batch.points.insert(batch.points.end(), p.begin(), p.end());
      batch.facet_vertices.push_back(found->second);
    }
    finish_facet(batch);
  }
  finish_cell(batch, volume(solid), label, part);
}

void append_polygon(CellBatch& batch, const std::vector<std::array<double, 2>>& polygon,
                    std::mt19937& random) {
  batch.dimension = 2;
  std::vector<std::uint16_t> edges(polygon.size());
  std::iota(edges.begin(), edges.end(), std::uint16_t{0});
  std::shuffle(edges.begin(), edges.end(), random);
  double area = 0;
  for (const std::uint16_t e : edges) {
    const auto next = static_cast<std::uint16_t>((e + 1U) % polygon.size());
    area += (polygon[e][0] * polygon[next][1] - polygon[e][1] * polygon[next][0]) / 2;
    const bool turned = random() % 2 != 0;
    batch.facet_vertices.insert(batch.facet_vertices.end(), {turned ? next : e, turned ? e : next});
    finish_facet(batch);
  }
  for (const auto& p : polygon) batch.points.insert(batch.points.end(), p.begin(), p.end());
  finish_cell(batch, area, geometry::Label::in, 0);
}

void append_segment(CellBatch& batch, double low, double high) {
  batch.dimension = 1;
  for (const std::uint16_t end : {std::uint16_t{0}, std::uint16_t{1}}) {
    batch.points.push_back(end == 0 ? low : high);
    batch.facet_vertices.push_back(end);
    finish_facet(batch);
  }
  finish_cell(batch, high - low, geometry::Label::in, 0);
}

SampleMesh random_mesh(std::mt19937& random, std::size_t cells, std::size_t batch_size) {
  struct Open {
    Polyhedron solid;
    std::int32_t parent;
    bool positive;
  };
  SampleMesh mesh;
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> unit(0.4, 0.6);
  std::queue<Open> open;  // breadth first, so that the cells are of about one size
  open.push({box({0, 0, 0}, {10, 10, 10}), -1, false});
  while (open.size() < cells) {
    const Open at = open.front();
    open.pop();
    Point normal{gauss(random), gauss(random), gauss(random)};
    const double length = std::sqrt(dot(normal, normal));
    for (double& x : normal) x /= length;
    double low = 1e9, high = -1e9;
    for (const auto& facet : at.solid.facets) {
      for (const Point& p : facet) low = std::min(low, dot(normal, p)), high = std::max(high, dot(normal, p));
    }
    const std::array<double, 4> plane{-(low + (high - low) * unit(random)), normal[0], normal[1], normal[2]};
    const auto node = static_cast<std::int32_t>(mesh.tree.nodes.size());
    mesh.tree.nodes.push_back({static_cast<std::uint32_t>(node), 0, 0});
    mesh.tree.hyperplanes.insert(mesh.tree.hyperplanes.end(), plane.begin(), plane.end());
    auto parts = split(at.solid, plane);
    if (at.parent < 0) mesh.tree.root = node;
    if (at.parent >= 0)
      (at.positive ? mesh.tree.nodes[at.parent].positive : mesh.tree.nodes[at.parent].negative) = node;
    open.push({std::move(parts[0]), node, false});
    open.push({std::move(parts[1]), node, true});
  }
  auto batch = std::make_shared<CellBatch>();
  for (; !open.empty(); open.pop()) {
    const Open& at = open.front();
    append(*batch, at.solid, geometry::Label::in, static_cast<std::int32_t>(random() % 10));
    mesh.volume += batch->volume.back();
    ++mesh.cells;
    const std::int32_t leaf = ~static_cast<std::int32_t>(mesh.cells);
    if (at.parent < 0) mesh.tree.root = leaf;
    if (at.parent >= 0)
      (at.positive ? mesh.tree.nodes[at.parent].positive : mesh.tree.nodes[at.parent].negative) = leaf;
    if (batch->size() < batch_size) continue;
    mesh.batches.push_back(std::move(batch));
    batch = std::make_shared<CellBatch>();
  }
  if (!batch->empty()) mesh.batches.push_back(std::move(batch));
  return mesh;
}

}  // namespace bsp2::samples
