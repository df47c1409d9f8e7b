#include "mesh/mesh_crossing.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/box_tree.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "mesh/mesh_line.hpp"
#include "text/csg_arguments.hpp"

namespace bsp2::model {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// Finds crossings among pairs of triangles; several finders may share the work on one mesh.
class CrossingFinder {
 public:
  CrossingFinder(const TriangleMesh& mesh, const geometry::BoxTree& tree) : mesh_(mesh), tree_(tree) {}

  /// The first one in the order of the triangles: where an edge goes through a triangle or two lie in one
  /// plane, and where there is none of these, of triangles that go through each other only along edges and
  /// corners.
  std::optional<MeshCrossing> first() {
    const auto find = [this](auto&& is_crossing) {
      for (std::uint32_t t = 0; t < mesh_.triangles.size() && !found_; ++t)
        tree_.visit_meeting(tree_[t], [&](std::uint32_t other) { return is_crossing(other, t); });
    };
    find([this](std::uint32_t other, std::uint32_t t) {
      return other != t && (edges_cross(other, t, sides(other, t)) || (other < t && overlaps(other, t)));
    });
    find([this](std::uint32_t other, std::uint32_t t) {
      return other < t && interiors_cross(other, t, sides(other, t), sides(t, other));
    });
    return found_;
  }
  /// Whether there is any where branch k meets itself or later ones, in the order of the tree: that is twice
  /// as fast.
  bool any(std::span<const geometry::BoxTree::Branch> branches, std::size_t k) {
    return tree_.visit_meeting_pairs(branches, k, [&](std::uint32_t i, std::uint32_t j) {
      const Sides of_j = sides(j, i);
      if (is_beside(i, j, of_j)) return false;
      const Sides of_i = sides(i, j);
      if (is_beside(j, i, of_i)) return false;
      return edges_cross(i, j, of_i) || edges_cross(j, i, of_j) || interiors_cross(i, j, of_i, of_j) ||
             overlaps(std::min(i, j), std::max(i, j));
    });
  }
  /// Takes over what another finder has hit. @return whether that makes a crossing of what each of them has.
  bool add(const CrossingFinder& other) {
    return std::ranges::any_of(other.hits_, [&](const auto& hit) {
      const auto [seen, is_new] = hits_.insert(hit);
      return !is_new && seen->second != hit.second;
    });
  }

 private:
  /// On which side of the plane of a triangle each corner of another one clearly lies; 0 where doubles do not
  /// tell, and for corners of both.
  using Sides = std::array<int, 3>;

  [[nodiscard]] Sides sides(std::uint32_t corners_of, std::uint32_t triangle) const {
    const auto &own = mesh_.triangles[corners_of], &other = mesh_.triangles[triangle];
    const auto& at = mesh_.points;
    Sides sides{};
    for (std::size_t k = 0; k < 3; ++k)
      if (std::find(other.begin(), other.end(), own[k]) == other.end())
        sides[k] = quick_orientation(at[other[0]], at[other[1]], at[other[2]], at[own[k]]).value_or(0);
    return sides;
  }

  /// Whether all corners of a triangle that it has not in common with another one clearly lie on one side of
  /// that: then nothing else is in both. So it is with nearly all pairs.
  [[nodiscard]] bool is_beside(std::uint32_t triangle, std::uint32_t other, const Sides& of_other) const {
    const auto &own = mesh_.triangles[triangle], &theirs = mesh_.triangles[other];
    int side = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::find(own.begin(), own.end(), theirs[k]) != own.end()) continue;
      if (of_other[k] == 0 || of_other[k] == -side) return false;
      side = of_other[k];
    }
    return side != 0;
  }

  /// Whether an edge of one triangle goes through another. Each edge is an edge of two triangles; one of
  /// them, in which it ascends, is enough.
  bool edges_cross(std::uint32_t edges_of, std::uint32_t triangle, const Sides& sides) {
    const auto& own = mesh_.triangles[edges_of];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (own[k] < own[next] && sides[k] * sides[next] < 0 && crosses(own[k], own[next], triangle, sides[k]))
        return true;
    }
    return false;
  }

  /// The corners of a triangle, first the one that is alone on its side of a plane; none if no two lie on
  /// different sides of it.
  static std::optional<Corners> alone_first(const Corners& corners, const Sides& sides, int& side) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      side = sides[k];
      if (side != 0 && sides[l] != side && sides[m] != side && sides[l] + sides[m] != 0)
        return Corners{corners[k], corners[l], corners[m]};
    }
    return std::nullopt;
  }

  /// Whether two triangles in different planes clearly share more than a point inside both: their stretches
  /// of the line that their planes share overlap. So edges that meet exactly, or pass through a corner, hide
  /// nothing. Source: Guigue and Devillers, "Fast and robust triangle-triangle overlap test using orientation
  /// predicates" (2003).
  bool interiors_cross(std::uint32_t one, std::uint32_t other, const Sides& of_one, const Sides& of_other) {
    int side_p = 0, side_q = 0;
    auto p = alone_first(mesh_.triangles[one], of_one, side_p);
    auto q = alone_first(mesh_.triangles[other], of_other, side_q);
    if (!p || !q) return false;
    if (side_p < 0) std::swap((*q)[1], (*q)[2]);
    if (side_q < 0) std::swap((*p)[1], (*p)[2]);
    const auto is_below = [this](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
      const auto& at = mesh_.points;
      return quick_orientation(at[a], at[b], at[c], at[d]).value_or(0) < 0;
    };
    if (!is_below((*p)[0], (*p)[1], (*q)[0], (*q)[1]) || !is_below((*p)[0], (*p)[2], (*q)[2], (*q)[0]))
      return false;
    const auto corners = [this](std::uint32_t t) {
      const auto& [a, b, c] = mesh_.triangles[t];
      return std::array{mesh_.points[a], mesh_.points[b], mesh_.points[c]};
    };
    const auto through = corners(one);
    found_ = {corners(other), {through.begin(), through.end()}, false};
    return true;
  }

  /// @param side of the plane of the triangle on which the edge begins.
  bool crosses(std::uint32_t p, std::uint32_t q, std::uint32_t triangle, int side) {
    const auto& at = mesh_.points;
    const auto& corners = mesh_.triangles[triangle];
    int positive = 0, negative = 0;
    std::size_t on = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int turn = orientation(at[p], at[q], at[corners[k]], at[corners[(k + 1) % 3]]);
      positive += turn > 0;
      negative += turn < 0;
      if (turn == 0) on = k;
    }
    if (positive > 0 && negative > 0) return false;
    if (positive + negative < 2) return false;  // through a corner
    if (positive + negative == 2 && !crosses_neighbour(p, q, triangle, on, side)) return false;
    found_ = {{at[corners[0]], at[corners[1]], at[corners[2]]}, {at[p], at[q]}, false};
    return true;
  }

  /// Where an edge hits an edge of a triangle: whether it goes through the other triangle there as well, in
  /// the same direction.
  bool crosses_neighbour(std::uint32_t p, std::uint32_t q, std::uint32_t triangle, std::size_t k, int side) {
    const auto& corners = mesh_.triangles[triangle];
    const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
    const auto [seen, is_new] = hits_.try_emplace({p, q, low, high, side}, triangle);
    return !is_new && seen->second != triangle;
  }

  /// Whether two triangles in one plane have inner points in common where the mesh winds around one side by
  /// two times more than around the other.
  bool overlaps(std::uint32_t one, std::uint32_t other) {
    const auto &s = mesh_.triangles[one], &t = mesh_.triangles[other];
    const auto& at = mesh_.points;
    if (is_clearly_apart(s, t)) return false;
    const int axis = axis_across(mesh_, s);
    std::array<Point2, 3> p, q;
    for (std::size_t k = 0; k < 3; ++k) p[k] = along(axis, at[s[k]]), q[k] = along(axis, at[t[k]]);
    const int side = orientation(p[0], p[1], p[2]);
    if (side == 0 || orientation(q[0], q[1], q[2]) != side) return false;
    if (are_parted(p, q, side) || are_parted(q, p, side) || !are_coplanar(mesh_, one, other)) return false;
    const auto middle = common_point(p, q, side);
    if (!middle || std::abs(times_covered(*middle, axis, one)) < 2) return false;
    found_ = {{at[t[0]], at[t[1]], at[t[2]]}, {at[s[0]], at[s[1]], at[s[2]]}, true};
    return true;
  }

  /// Whether a corner of t lies beside the plane of s, where doubles tell for sure.
  [[nodiscard]] bool is_clearly_apart(const Corners& s, const Corners& t) const {
    const auto& at = mesh_.points;
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) {
      if (std::find(s.begin(), s.end(), v) != s.end()) return false;
      const auto side = quick_orientation(at[s[0]], at[s[1]], at[s[2]], at[v]);
      return side && *side != 0;
    });
  }

  /// Whether an edge of one triangle parts them. @param side how both are wound.
  static bool are_parted(const std::array<Point2, 3>& p, const std::array<Point2, 3>& q, int side) {
    for (std::size_t k = 0; k < 3; ++k)
      if (std::all_of(q.begin(), q.end(),
                      [&](const Point2& v) { return side * orientation(p[k], p[(k + 1) % 3], v) <= 0; }))
        return true;
    return false;
  }

  /// A point strictly inside both: about the middle of what they share, which is clipped in rounded
  /// arithmetic.
  static std::optional<Point2> common_point(const std::array<Point2, 3>& p, const std::array<Point2, 3>& q,
                                            int side) {
    std::vector<Point2> shared(p.begin(), p.end());
    for (std::size_t k = 0; k < 3; ++k) {
      const Point2 &a = q[k], &b = q[(k + 1) % 3];
      const auto depth = [&](const Point2& v) {
        return side * ((b.u - a.u) * (v.v - a.v) - (b.v - a.v) * (v.u - a.u));
      };
      std::vector<Point2> rest;
      for (std::size_t i = 0; i < shared.size(); ++i) {
        const Point2 &from = shared[i], &to = shared[(i + 1) % shared.size()];
        const double x = depth(from), y = depth(to);
        if (x >= 0) rest.push_back(from);
        if ((x > 0 && y < 0) || (x < 0 && y > 0))
          rest.push_back({from.u + x / (x - y) * (to.u - from.u), from.v + x / (x - y) * (to.v - from.v)});
      }
      shared = std::move(rest);
    }
    if (shared.size() < 3) return std::nullopt;
    Point2 middle{0, 0};
    for (const Point2& v : shared)
      middle.u += v.u / static_cast<double>(shared.size()),
          middle.v += v.v / static_cast<double>(shared.size());
    for (const auto& triangle : {p, q})
      for (std::size_t k = 0; k < 3; ++k)
        if (side * orientation(triangle[k], triangle[(k + 1) % 3], middle) <= 0) return std::nullopt;
    return middle;
  }

  /// How many triangles in the plane of this one cover the point, those wound in opposite ways cancelling
  /// each other.
  [[nodiscard]] int times_covered(const Point2& at, int axis, std::uint32_t triangle) const {
    const auto k = static_cast<std::size_t>(axis);
    geometry::Box3 line = tree_[triangle];
    line.low[(k + 1) % 3] = line.high[(k + 1) % 3] = at.u;
    line.low[(k + 2) % 3] = line.high[(k + 2) % 3] = at.v;
    int times = 0;
    tree_.visit_meeting(line, [&](std::uint32_t other) {
      if (other == triangle || are_coplanar(mesh_, triangle, other)) times += meets(mesh_, other, axis, at);
      return false;
    });
    return times;
  }

  const TriangleMesh& mesh_;
  const geometry::BoxTree& tree_;
  std::optional<MeshCrossing> found_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, int>, std::uint32_t> hits_;
};

std::string point_text(const Point3& p) {
  std::string text = "(";
  text += text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]);
  return text += ")";
}

}  // namespace

std::optional<MeshCrossing> self_crossing(const TriangleMesh& mesh, unsigned threads) {
  constexpr std::size_t parts_of_thread = 32, most_parts = 256,
                        triangles_of_part = 256;  // each part is held against all later ones
  const geometry::BoxTree tree(triangle_boxes(mesh));
  const std::size_t parts =
      std::min({parts_of_thread * threads, most_parts, mesh.triangles.size() / triangles_of_part});
  const auto branches = tree.branches(threads > 1 ? parts : 1);
  std::vector<CrossingFinder> finders(branches.size(), CrossingFinder(mesh, tree));
  std::atomic<bool> found = false;
  geometry::for_each_range(branches.size(), 1, threads, [&](std::size_t k, std::size_t) {
    if (!found && finders[k].any(branches, k)) found = true;
  });
  for (std::size_t k = 1; k < finders.size() && !found; ++k) found = finders[0].add(finders[k]);
  return found ? CrossingFinder(mesh, tree).first() : std::nullopt;
}

std::string text_of(const MeshCrossing& crossing) {
  const auto list = [](const auto& points) {
    std::string text;
    for (const Point3& p : points) text += (text.empty() ? "" : ", ") + point_text(p);
    return text;
  };
  if (crossing.other.size() == 2)
    return "the edge from " + point_text(crossing.other[0]) + " to " + point_text(crossing.other[1]) +
           " goes through the triangle " + list(crossing.triangle);
  return "the triangle " + list(crossing.other) + " and the triangle " + list(crossing.triangle) +
         (!crossing.in_plane ? " go through each other"
                             : " cover each other in part, wound alike in one plane");
}

}  // namespace bsp2::model
