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

#include "bsp2/geometry/support/parallel.hpp"
#include "mesh/box_tree.hpp"
#include "mesh/mesh_line.hpp"
#include "text/csg_arguments.hpp"

namespace bsp2::model {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// Finds crossings among pairs of triangles; several finders may share the work on one mesh.
class CrossingFinder {
 public:
  CrossingFinder(const TriangleMesh& mesh, const BoxTree& tree) : mesh_(mesh), tree_(tree) {}

  /// The first one in the order of the triangles.
  std::optional<MeshCrossing> first() {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (tree_.visit_meeting(tree_[t], [&](std::uint32_t other) {
            return other != t && (edges_cross(other, t) || (other < t && overlaps(other, t)));
          }))
        return found_;
    return std::nullopt;
  }
  /// Whether there is any where branch k meets itself or later ones, in the order of the tree: that is twice
  /// as fast.
  bool any(std::span<const BoxTree::Branch> branches, std::size_t k) {
    return tree_.visit_meeting_pairs(branches, k, [&](std::uint32_t i, std::uint32_t j) {
      return edges_cross(i, j) || edges_cross(j, i) || overlaps(std::min(i, j), std::max(i, j));
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
  /// Whether an edge of one triangle goes through another. Each edge is an edge of two triangles; one of
  /// them, in which it ascends, is enough.
  bool edges_cross(std::uint32_t edges_of, std::uint32_t triangle) {
    const auto& own = mesh_.triangles[edges_of];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = own[k], q = own[(k + 1) % 3];
      const auto& other = mesh_.triangles[triangle];
      const auto is_corner = [&](std::uint32_t v) {
        return std::find(other.begin(), other.end(), v) != other.end();
      };
      if (p < q && !is_corner(p) && !is_corner(q) && crosses(p, q, triangle)) return true;
    }
    return false;
  }

  bool crosses(std::uint32_t p, std::uint32_t q, std::uint32_t triangle) {
    const auto& at = mesh_.points;
    const auto& corners = mesh_.triangles[triangle];
    const Point3 &a = at[corners[0]], &b = at[corners[1]], &c = at[corners[2]];
    const auto side_p = quick_orientation(a, b, c, at[p]);
    if (!side_p || *side_p == 0) return false;
    const auto side_q = quick_orientation(a, b, c, at[q]);
    if (!side_q || *side_q != -*side_p) return false;
    int positive = 0, negative = 0;
    std::size_t on = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int side = orientation(at[p], at[q], at[corners[k]], at[corners[(k + 1) % 3]]);
      positive += side > 0;
      negative += side < 0;
      if (side == 0) on = k;
    }
    if (positive > 0 && negative > 0) return false;
    if (positive + negative < 2) return false;  // through a corner
    if (positive + negative == 2 && !crosses_neighbour(p, q, triangle, on, *side_p)) return false;
    found_ = {{a, b, c}, {at[p], at[q]}};
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
    found_ = {{at[t[0]], at[t[1]], at[t[2]]}, {at[s[0]], at[s[1]], at[s[2]]}};
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
    Box3 line = tree_[triangle];
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
  const BoxTree& tree_;
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
  const BoxTree tree(triangle_boxes(mesh));
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
         " cover each other in part, wound alike in one plane";
}

}  // namespace bsp2::model
