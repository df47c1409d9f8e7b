#include "mesh_crossing.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/model/csg.hpp"
#include "csg_arguments.hpp"
#include "csg_scanner.hpp"
#include "polyhedron.hpp"

namespace bsp2::model {
namespace {

struct Box {
  Point3 low, high;
  [[nodiscard]] bool meets(const Box& other) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (low[k] > other.high[k] || other.low[k] > high[k]) return false;
    return true;
  }
  void unite(const Box& other) {
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], other.low[k]), high[k] = std::max(high[k], other.high[k]);
  }
};

/// A tree over boxes, halved at the median along the longest axis. Node i has the children 2 i + 1 and 2 i + 2.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!boxes_.empty()) build(0, order_);
  }

  /// Calls visit(i) for the boxes that meet this one until it answers true. @return whether it did.
  template <typename Visit>
  bool visit_meeting(const Box& box, Visit&& visit) const {
    std::vector<std::pair<std::size_t, std::span<const std::uint32_t>>> open{{0, order_}};
    while (!open.empty()) {
      const auto [node, items] = open.back();
      open.pop_back();
      if (items.empty() || !nodes_[node].meets(box)) continue;
      if (items.size() <= leaf) {
        for (const std::uint32_t i : items)
          if (boxes_[i].meets(box) && visit(i)) return true;
        continue;
      }
      open.emplace_back(2 * node + 1, items.first(items.size() / 2));
      open.emplace_back(2 * node + 2, items.subspan(items.size() / 2));
    }
    return false;
  }

 private:
  static constexpr std::size_t leaf = 4;

  void build(std::size_t node, std::span<std::uint32_t> items) {  // depth: log2 of the number of boxes
    if (node >= nodes_.size()) nodes_.resize(node + 1);
    Box all = boxes_[items[0]];
    for (const std::uint32_t i : items) all.unite(boxes_[i]);
    nodes_[node] = all;
    if (items.size() <= leaf) return;
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (all.high[k] - all.low[k] > all.high[axis] - all.low[axis]) axis = k;
    const std::size_t half = items.size() / 2;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(), [&](std::uint32_t a, std::uint32_t b) {
      return boxes_[a].low[axis] + boxes_[a].high[axis] < boxes_[b].low[axis] + boxes_[b].high[axis];
    });
    build(2 * node + 1, items.first(half));
    build(2 * node + 2, items.subspan(half));
  }

  std::vector<Box> boxes_, nodes_;
  std::vector<std::uint32_t> order_;
};

class CrossingFinder {
 public:
  explicit CrossingFinder(const TriangleMesh& mesh) : mesh_(mesh) {}

  std::optional<MeshCrossing> run() {
    std::vector<Box> boxes;
    boxes.reserve(mesh_.triangles.size());
    for (const auto& [a, b, c] : mesh_.triangles) {
      Box box{mesh_.points[a], mesh_.points[a]};
      box.unite({mesh_.points[b], mesh_.points[b]});
      box.unite({mesh_.points[c], mesh_.points[c]});
      boxes.push_back(box);
    }
    const BoxTree tree(boxes);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (tree.visit_meeting(boxes[t], [&](std::uint32_t other) { return other != t && edges_cross(other, t); })) return found_;
    return std::nullopt;
  }

 private:
  /// Whether an edge of one triangle goes through another. Each edge is an edge of two triangles; one of them, in which it
  /// ascends, is enough.
  bool edges_cross(std::uint32_t edges_of, std::uint32_t triangle) {
    const auto& own = mesh_.triangles[edges_of];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = own[k], q = own[(k + 1) % 3];
      const auto& other = mesh_.triangles[triangle];
      const auto is_corner = [&](std::uint32_t v) { return std::find(other.begin(), other.end(), v) != other.end(); };
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
    found_ = {{at[p], at[q]}, {a, b, c}};
    return true;
  }

  /// Where an edge hits an edge of a triangle: whether it goes through the other triangle there as well, in the same direction.
  bool crosses_neighbour(std::uint32_t p, std::uint32_t q, std::uint32_t triangle, std::size_t k, int side) {
    const auto& corners = mesh_.triangles[triangle];
    const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
    const auto [seen, is_new] = hits_.try_emplace({p, q, low, high, side}, triangle);
    return !is_new && seen->second != triangle;
  }

  const TriangleMesh& mesh_;
  std::optional<MeshCrossing> found_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, int>, std::uint32_t> hits_;
};

std::string point_text(const Point3& p) {
  std::string text = "(";
  text += text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]);
  return text += ")";
}

}  // namespace

std::optional<MeshCrossing> self_crossing(const TriangleMesh& mesh) { return CrossingFinder(mesh).run(); }

std::string text_of(const MeshCrossing& crossing) {
  const auto& [a, b, c] = crossing.triangle;
  return "the edge from " + point_text(crossing.edge[0]) + " to " + point_text(crossing.edge[1]) + " goes through the triangle " + point_text(a) + ", " + point_text(b) + ", " +
         point_text(c);
}

std::vector<std::string> crossing_warnings(const Model& model, std::string_view text, const std::string& name) {
  constexpr std::size_t most = 100;
  std::vector<std::string> warnings;
  std::set<const Node*> seen;
  LineFinder lines(text);
  for (const auto& [offset, solid] : model.polyhedra) {
    if (warnings.size() == most) break;
    const Node& node = solid.node();
    const auto* shape = std::get_if<Primitive>(&node.value);
    const auto* mesh = shape ? std::get_if<TriangleMesh>(shape) : nullptr;
    if (!mesh || !seen.insert(&node).second) continue;
    if (const auto crossing = self_crossing(*mesh))
      warnings.push_back(name + ":" + lines.at(offset) + ": this polyhedron crosses itself: " + text_of(*crossing) +
                         ". A point counts once, however often the faces wind around it; the volume that the faces sum up to, " + text_of(signed_volume(mesh->points, mesh->triangles)) +
                         ", may count it several times");
  }
  return warnings;
}

}  // namespace bsp2::model
