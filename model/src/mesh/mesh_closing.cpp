#include "mesh/mesh_closing.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "mesh/point_tree.hpp"

namespace bsp2::model {
namespace {

std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

double squared_distance(const Point3& p, const Point3& q) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (p[k] - q[k]) * (p[k] - q[k]);
  return sum;
}

std::vector<std::uint32_t> ends_of(const std::vector<OpenEdge>& edges) {
  std::vector<std::uint32_t> ends;
  for (const OpenEdge& edge : edges) ends.insert(ends.end(), {edge.a, edge.b});
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

/// Whether v lies between a and b on their segment, within `tolerance` of it but not of an end; `place` is
/// where.
bool on_segment(const Point3& a, const Point3& b, const Point3& v, double tolerance, double& place) {
  double along = 0, length = 0;
  for (int k = 0; k < 3; ++k) {
    along += (v[k] - a[k]) * (b[k] - a[k]);
    length += (b[k] - a[k]) * (b[k] - a[k]);
  }
  if (length == 0) return false;
  place = along / length;
  if (tolerance == 0) return inside_segment(a, b, v);
  if (!(place > 0 && place < 1)) return false;
  const double limit = tolerance * tolerance;
  if (squared_distance(v, a) <= limit || squared_distance(v, b) <= limit) return false;
  Point3 foot;
  for (int k = 0; k < 3; ++k) foot[k] = a[k] + place * (b[k] - a[k]);
  return squared_distance(foot, v) <= limit;
}

struct Insertion {
  std::uint64_t edge;
  double place;  ///< from the edge's smaller end
  std::uint32_t vertex;
};

/// Empty also if there are more than `most`: a heap of overlapping edges, which stays open.
std::vector<Insertion> t_vertices(const std::vector<Point3>& points, const std::vector<OpenEdge>& edges,
                                  const Tolerance& tolerance, std::size_t most) {
  const PointTree tree(points, ends_of(edges));
  std::vector<Insertion> insertions;
  for (const OpenEdge& edge : edges) {
    const Point3 &a = points[edge.a], &b = points[edge.b];
    const double reach = std::max(tolerance.at(a), tolerance.at(b));
    // Rounding of the tree's own arithmetic must not lose a point that lies on the edge exactly.
    const double slack = 1e-12 * (std::fabs(a[0]) + std::fabs(a[1]) + std::fabs(a[2]) + std::fabs(b[0]) +
                                  std::fabs(b[1]) + std::fabs(b[2]));
    tree.visit_near_segment(a, b, reach + slack, [&](std::uint32_t v) {
      double place = 0;
      if (v != edge.a && v != edge.b && on_segment(a, b, points[v], reach, place))
        insertions.push_back({key_of(edge.a, edge.b), place, v});
    });
    if (insertions.size() > most) return {};
  }
  std::sort(insertions.begin(), insertions.end(), [](const Insertion& x, const Insertion& y) {
    return std::tie(x.edge, x.place, x.vertex) < std::tie(y.edge, y.place, y.vertex);
  });
  return insertions;
}

FaceCycles insert(const FaceCycles& faces, const std::vector<Insertion>& insertions) {
  const auto by_edge = [](const Insertion& x, std::uint64_t edge) { return x.edge < edge; };
  FaceCycles result;
  result.corners.reserve(faces.corners.size() + 2 * insertions.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto face = faces[f];
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t from = face[i], to = face[i + 1 == face.size() ? 0 : i + 1];
      result.corners.push_back(from);
      const std::uint64_t edge = key_of(from, to);
      const auto begin = std::lower_bound(insertions.begin(), insertions.end(), edge, by_edge);
      const std::size_t first = result.corners.size();
      for (auto at = begin; at != insertions.end() && at->edge == edge; ++at)
        result.corners.push_back(at->vertex);
      if (from > to)
        std::reverse(result.corners.begin() + static_cast<std::ptrdiff_t>(first), result.corners.end());
    }
    result.end_face();
  }
  return result;
}

/// Removes repeated corners and spikes of one cycle, which becomes empty if nothing else is left.
void clean(std::vector<std::uint32_t>& cycle) {
  std::size_t size = 0;
  for (const std::uint32_t corner : std::vector(cycle)) {
    if (size >= 1 && cycle[size - 1] == corner) continue;
    if (size >= 2 && cycle[size - 2] == corner) {
      --size;
      continue;
    }
    cycle[size++] = corner;
  }
  std::size_t first = 0;  // the same where the end of the cycle meets its beginning
  while (size - first >= 2) {
    if (cycle[first] == cycle[size - 1]) {
      --size;
    } else if (size - first >= 3 && cycle[first] == cycle[size - 2]) {
      size -= 2;
    } else if (size - first >= 3 && cycle[first + 1] == cycle[size - 1]) {
      ++first;
      --size;
    } else {
      break;
    }
  }
  cycle.resize(size);
  cycle.erase(cycle.begin(), cycle.begin() + static_cast<std::ptrdiff_t>(first));
  if (cycle.size() < 3) cycle.clear();
}

bool on_a_line(const std::vector<Point3>& points, std::span<const std::uint32_t> cycle) {
  for (std::size_t i = 2; i < cycle.size(); ++i)
    if (!collinear(points[cycle[0]], points[cycle[1]], points[cycle[i]])) return false;
  return true;
}

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

double Tolerance::at(const Point3& p) const {
  return absolute + relative * std::sqrt(squared_distance(p, {}));
}

std::vector<OpenEdge> open_edges(const FaceCycles& faces) {
  // Sorted by the smaller end, by counting; then the few edges of each of these ends.
  struct Use {
    std::uint32_t high;
    int direction;
  };
  std::vector<std::uint32_t> ends(1);  // ends[v + 1], then [v]: one past the uses of v
  const auto for_each_edge = [&](auto&& visit) {
    for (std::size_t f = 0, begin = 0; f < faces.size(); begin = faces.ends[f++]) {
      std::uint32_t from = faces.ends[f] > begin ? faces.corners[faces.ends[f] - 1] : 0;
      for (std::size_t i = begin; i < faces.ends[f]; ++i) {
        const std::uint32_t to = faces.corners[i];
        if (from < to) visit(from, to, 1);
        if (to < from) visit(to, from, -1);
        from = to;
      }
    }
  };
  for (const std::uint32_t corner : faces.corners)
    if (corner + std::size_t{2} > ends.size()) ends.resize(corner + std::size_t{2});
  for_each_edge([&](std::uint32_t low, std::uint32_t, int) { ++ends[low + std::size_t{1}]; });
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<Use> uses(ends.back());
  for_each_edge([&](std::uint32_t low, std::uint32_t high, int direction) {
    uses[ends[low]++] = {high, direction};
  });

  std::vector<OpenEdge> open;
  for (std::uint32_t low = 0, begin = 0; low + std::size_t{1} < ends.size(); begin = ends[low++]) {
    std::sort(uses.begin() + begin, uses.begin() + ends[low],
              [](const Use& x, const Use& y) { return x.high < y.high; });
    for (std::uint32_t i = begin; i < ends[low];) {
      const std::uint32_t high = uses[i].high;
      int excess = 0;
      for (; i < ends[low] && uses[i].high == high; ++i) excess += uses[i].direction;
      if (excess != 0) open.push_back({low, high, excess});
    }
  }
  return open;
}

FaceCycles without_degenerate(const std::vector<Point3>& points, const FaceCycles& faces) {
  FaceCycles result;
  result.corners.reserve(faces.corners.size());
  result.ends.reserve(faces.size());
  std::vector<std::uint32_t> cycle;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto face = faces[f];
    cycle.assign(face.begin(), face.end());
    if (face.size() != 3 || face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) clean(cycle);
    if (cycle.empty() || on_a_line(points, cycle)) continue;
    result.corners.insert(result.corners.end(), cycle.begin(), cycle.end());
    result.end_face();
  }
  return result;
}

FaceCycles weld(const std::vector<Point3>& points, const FaceCycles& faces, const Tolerance& tolerance) {
  const std::vector<std::uint32_t> ends = ends_of(open_edges(faces));
  const PointTree tree(points, ends);
  std::vector<std::uint32_t> parent(points.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (const std::uint32_t p : ends) {
    const double reach = tolerance.at(points[p]);
    tree.visit_near_segment(points[p], points[p], reach, [&](std::uint32_t q) {
      if (squared_distance(points[p], points[q]) > reach * reach) return;
      const std::uint32_t a = root_of(parent, p), b = root_of(parent, q);
      parent[std::max(a, b)] = std::min(a, b);
    });
  }
  FaceCycles result = faces;
  for (std::uint32_t& corner : result.corners) corner = root_of(parent, corner);
  return result;
}

FaceCycles split_at_t_vertices(const std::vector<Point3>& points, FaceCycles faces,
                               const Tolerance& tolerance) {
  std::size_t left = 0;  // far more than a mesh with a few gaps has, in all rounds: in a heap each makes many
                         // times as many as the last one
  for (int round = 0; round < 8;
       ++round) {  // inserting bends an edge a little, within the tolerance: then once more
    const std::vector<OpenEdge> edges = open_edges(faces);
    if (edges.empty()) break;
    if (round == 0) left = 64 * edges.size() + 1000;
    const std::vector<Insertion> insertions = t_vertices(points, edges, tolerance, left);
    if (insertions.empty()) break;
    left -= insertions.size();
    faces = insert(faces, insertions);
  }
  return faces;
}

}  // namespace bsp2::model
