#include "mesh/mesh_patching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

namespace bsp2::model {
namespace {

constexpr std::size_t most_by_bend = 40;   ///< corners: the time grows with the third power
constexpr std::size_t most_as_face = 512;  ///< at worst it grows with the second

double length(const Point3& p) { return std::hypot(p[0], p[1], p[2]); }

/// Of length 1, or 0 where there is none.
Point3 unit(const Point3& p) {
  const double l = length(p);
  if (!(l > 0) || !std::isfinite(l)) return {};
  return {p[0] / l, p[1] / l, p[2] / l};
}

/// An edge that a hole's triangles have to use, from `from` to `to`, and the direction of the face on its
/// other side.
struct RimEdge {
  std::uint32_t from, to;
  Point3 normal;
};

/// A face at each open edge, by the edge's place in `open`.
std::vector<Point3> normals_at(const std::vector<Point3>& points, const FaceCycles& faces,
                               const std::vector<OpenEdge>& open) {
  std::vector<Point3> normals(open.size());
  std::vector<bool> is_end(points.size());
  for (const OpenEdge& edge : open) is_end[edge.a] = is_end[edge.b] = true;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto face = faces[f];
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t from = face[i], to = face[(i + 1) % face.size()], a = std::min(from, to),
                          b = std::max(from, to);
      if (!is_end[a] || !is_end[b]) continue;
      const auto at =
          std::lower_bound(open.begin(), open.end(), std::pair(a, b),
                           [](const OpenEdge& edge, const std::pair<std::uint32_t, std::uint32_t>& key) {
                             return std::pair(edge.a, edge.b) < key;
                           });
      if (at == open.end() || at->a != a || at->b != b || (at->excess > 0) != (from < to)) continue;
      Point3 sum{};
      for (std::size_t j = 1; j + 1 < face.size(); ++j) {
        const Point3 part =
            cross(minus(points[face[j]], points[face[0]]), minus(points[face[j + 1]], points[face[0]]));
        for (int k = 0; k < 3; ++k) sum[k] += part[k];
      }
      normals[static_cast<std::size_t>(at - open.begin())] = unit(sum);
    }
  }
  return normals;
}

/// The rims as loops that go through no corner twice.
class LoopFinder {
 public:
  LoopFinder(const std::vector<Point3>& points, const FaceCycles& faces, const std::vector<OpenEdge>& open)
      : points_(points) {
    const std::vector<Point3> normals = normals_at(points, faces, open);
    for (std::size_t i = 0; i < open.size(); ++i)
      for (int times = std::abs(open[i].excess); times > 0; --times) {
        const OpenEdge& edge = open[i];
        edges_.push_back(edge.excess > 0 ? RimEdge{edge.b, edge.a, normals[i]}
                                         : RimEdge{edge.a, edge.b, normals[i]});
      }
    std::stable_sort(edges_.begin(), edges_.end(), [](const RimEdge& x, const RimEdge& y) {
      return std::tie(x.from, x.to) < std::tie(y.from, y.to);
    });
    used_.resize(edges_.size());
    first_.resize(points.size());
    for (std::size_t i = edges_.size(); i-- > 0;) first_[edges_[i].from] = i;
  }

  /// Calls visit(loop) for each.
  template <typename Visit>
  void run(Visit&& visit) {
    constexpr std::size_t none = ~std::size_t{0};
    std::vector<std::size_t> place(points_.size(),
                                   none);  // of a corner in the path, as the beginning of its edge
    std::vector<RimEdge> path;
    for (std::size_t first = 0; first < edges_.size(); ++first) {
      if (used_[first]) continue;
      used_[first] = true;
      path.assign(1, edges_[first]);
      place[edges_[first].from] = 0;
      while (!path.empty()) {
        const std::uint32_t at = path.back().to;
        if (place[at] == none) {
          const std::size_t next = next_of(path.back());
          used_[next] = true;
          place[at] = path.size();
          path.push_back(edges_[next]);
          continue;
        }
        const std::size_t begin = place[at];
        visit(std::span<const RimEdge>(path).subspan(begin));
        for (std::size_t i = begin; i < path.size(); ++i) place[path[i].from] = none;
        path.resize(begin);
      }
    }
  }

 private:
  const std::vector<Point3>& points_;
  std::vector<RimEdge> edges_;  ///< by their beginnings
  std::vector<bool> used_;
  std::vector<std::size_t>
      first_;  ///< of the edges from a corner, or a later one where those before it are used

  /// An edge that goes on from this one. There is one, since as many lead to a corner as from there. Where
  /// there are several, holes meet: the next one around the corner is on the rim of the same hole.
  std::size_t next_of(const RimEdge& edge) {
    constexpr std::size_t most_seen = 64;
    std::size_t& first = first_[edge.to];
    while (used_[first]) ++first;
    std::size_t best = first;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t at = first; at < edges_.size() && edges_[at].from == edge.to && at < first + most_seen;
         ++at) {
      const double angle = used_[at] ? least : angle_between(edge, edges_[at]);
      if (angle < least) least = angle, best = at;
    }
    return best;
  }

  /// Around the corner between them clockwise, seen from outside, from the first edge to the second one: what
  /// the hole takes.
  [[nodiscard]] double angle_between(const RimEdge& in, const RimEdge& out) const {
    Point3 normal = in.normal;
    for (int k = 0; k < 3; ++k) normal[k] += out.normal[k];
    normal = unit(normal);
    const Point3 back = unit(minus(points_[in.from], points_[in.to])),
                 on = unit(minus(points_[out.to], points_[out.from]));
    const double angle =
        std::atan2(dot(cross(on, back), normal), dot(on, back) - dot(on, normal) * dot(back, normal));
    return angle > 0 ? angle : angle + 2 * std::numbers::pi;
  }
};

/// The triangles over a loop that bend least.
class BendingFiller {
 public:
  BendingFiller(const std::vector<Point3>& points, std::span<const RimEdge> loop)
      : points_(points), loop_(loop), size_(loop.size()), best_(size_ * size_) {}

  void fill(std::vector<Triangle>& triangles) {
    for (std::size_t i = 0; i + 1 < size_; ++i) at(i, i + 1) = {0, 0, i, loop_[i].normal};
    for (std::size_t gap = 2; gap < size_; ++gap)
      for (std::size_t i = 0; i + gap < size_; ++i) choose(i, i + gap);
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, size_ - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j == i + 1) continue;
      const std::size_t k = at(i, j).apex;
      triangles.push_back({loop_[i].from, loop_[k].from, loop_[j].from});
      open.insert(open.end(), {{i, k}, {k, j}});
    }
  }

 private:
  /// Triangles over the part of the loop from corner i to corner j, and the direction of the one at the edge
  /// between these.
  struct Part {
    double bend = 0, area = 0;
    std::size_t apex = 0;
    Point3 normal{};
  };
  const std::vector<Point3>& points_;
  std::span<const RimEdge> loop_;
  std::size_t size_;
  std::vector<Part> best_;

  Part& at(std::size_t i, std::size_t j) { return best_[i * size_ + j]; }
  [[nodiscard]] const Point3& corner(std::size_t i) const { return points_[loop_[i].from]; }

  /// Angle between triangles at an edge, times its length.
  [[nodiscard]] double bend(const Point3& one, const Point3& other, std::size_t i, std::size_t j) const {
    const double cosine = dot(one, other);
    const bool is_known = dot(one, one) > 0 && dot(other, other) > 0;
    return (is_known ? std::acos(std::clamp(cosine, -1.0, 1.0)) : std::numbers::pi / 2) *
           length(minus(corner(i), corner(j)));
  }

  void choose(std::size_t i, std::size_t j) {
    bool is_first = true;
    Part best;
    for (std::size_t k = i + 1; k < j; ++k) {
      const Part &left = at(i, k), &right = at(k, j);
      const Point3 area = cross(minus(corner(k), corner(i)), minus(corner(j), corner(i))),
                   normal = unit(area);
      Part part{left.bend + right.bend + bend(normal, left.normal, i, k) + bend(normal, right.normal, k, j),
                left.area + right.area + length(area), k, normal};
      if (i == 0 && j == size_ - 1) part.bend += bend(normal, loop_[j].normal, j, i);
      if (is_first || is_better(part, best)) best = part;
      is_first = false;
    }
    at(i, j) = best;
  }

  /// Bends that differ by rounding only are equal.
  static bool is_better(const Part& part, const Part& best) {
    const double noise = 1e-6 * std::max(part.bend, best.bend);
    return part.bend < best.bend - noise || (part.bend <= best.bend + noise && part.area < best.area);
  }
};

void add_cone(std::vector<Point3>& points, std::span<const RimEdge> loop, std::vector<Triangle>& triangles) {
  const auto apex = static_cast<std::uint32_t>(points.size());
  Point3 sum{};
  for (const RimEdge& edge : loop)
    for (int k = 0; k < 3; ++k) sum[k] += points[edge.from][k];
  const auto count = static_cast<double>(loop.size());
  points.push_back({sum[0] / count, sum[1] / count, sum[2] / count});
  for (const RimEdge& edge : loop) triangles.push_back({edge.from, edge.to, apex});
}

}  // namespace

Patches patches_of(std::vector<Point3>& points, const FaceCycles& faces, const std::vector<OpenEdge>& open) {
  Patches patches;
  const std::vector<Point3> given = points;  // apices do not move what is looked at
  LoopFinder finder(given, faces, open);
  Triangulator triangulator(given);
  std::vector<std::uint32_t> cycle;
  finder.run([&](std::span<const RimEdge> loop) {
    ++patches.holes;
    if (loop.size() > most_as_face) {
      add_cone(points, loop, patches.triangles);
    } else if (loop.size() > most_by_bend) {
      cycle.clear();
      for (const RimEdge& edge : loop) cycle.push_back(edge.from);
      triangulator.triangulate(cycle, patches.triangles);
    } else {
      BendingFiller(given, loop).fill(patches.triangles);
    }
  });
  return patches;
}

}  // namespace bsp2::model
