#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/support/box_tree.hpp"
#include "mesh/predicates.hpp"

namespace bsp2::model {

/// A balanced tree over points, to find those near a segment without looking at all of them.
class PointTree {
 public:
  PointTree(const std::vector<Point3>& points, std::vector<std::uint32_t> indices)
      : points_(points), indices_(std::move(indices)) {
    if (!indices_.empty()) build(0, static_cast<std::uint32_t>(indices_.size()));
  }

  /// Calls visit(point index) for points that may lie within `distance` of a point until it answers false:
  /// those of its own branch first.
  template <class Visit>
  void visit_near(const Point3& point, double distance, Visit visit) const {
    if (nodes_.empty()) return;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const Node& node = nodes_[stack.back()];
      stack.pop_back();
      if (gap(node.box, point) > distance) continue;
      if (node.left == 0) {
        for (std::uint32_t i = node.begin; i < node.end; ++i)
          if (!visit(indices_[i])) return;
      } else {
        const bool is_left_nearer = gap(nodes_[node.left].box, point) <= gap(nodes_[node.right].box, point);
        stack.push_back(is_left_nearer ? node.right : node.left);
        stack.push_back(is_left_nearer ? node.left : node.right);
      }
    }
  }

  /// Calls visit(point index) for all points that may lie within `distance` of the segment a b (and some
  /// others).
  template <class Visit>
  void visit_near_segment(const Point3& a, const Point3& b, double distance, Visit visit) const {
    if (nodes_.empty()) return;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const Node& node = nodes_[stack.back()];
      stack.pop_back();
      if (!near(node.box, a, b, distance)) continue;
      if (node.left == 0) {
        for (std::uint32_t i = node.begin; i < node.end; ++i) visit(indices_[i]);
      } else {
        stack.push_back(node.right);
        stack.push_back(node.left);
      }
    }
  }

 private:
  struct Node {
    geometry::Box3 box;
    std::uint32_t begin, end;
    std::uint32_t left = 0, right = 0;  ///< 0 = a leaf
  };

  std::uint32_t build(std::uint32_t begin, std::uint32_t end) {
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    geometry::Box3 box{points_[indices_[begin]], points_[indices_[begin]]};
    for (std::uint32_t i = begin; i < end; ++i)
      for (int k = 0; k < 3; ++k) {
        box.low[k] = std::min(box.low[k], points_[indices_[i]][k]);
        box.high[k] = std::max(box.high[k], points_[indices_[i]][k]);
      }
    nodes_.push_back({box, begin, end});
    if (end - begin <= 8) return at;
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (box.high[k] - box.low[k] > box.high[axis] - box.low[axis]) axis = k;
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(indices_.begin() + begin, indices_.begin() + middle, indices_.begin() + end,
                     [&](std::uint32_t p, std::uint32_t q) { return points_[p][axis] < points_[q][axis]; });
    const std::uint32_t left = build(begin, middle), right = build(middle, end);  // depth: log2 of the size
    nodes_[at].left = left;
    nodes_[at].right = right;
    return at;
  }

  /// How far a point is from a box along the axis along which it is farthest.
  static double gap(const geometry::Box3& box, const Point3& point) {
    double most = 0;
    for (int k = 0; k < 3; ++k) most = std::max({most, box.low[k] - point[k], point[k] - box.high[k]});
    return most;
  }

  /// Whether the segment meets the box enlarged by `distance`: its parameters clipped by the three slabs.
  static bool near(const geometry::Box3& box, const Point3& a, const Point3& b, double distance) {
    double from = -1e-9, to = 1 + 1e-9;
    for (int k = 0; k < 3; ++k) {
      const double low = box.low[k] - distance, high = box.high[k] + distance, length = b[k] - a[k];
      if (length == 0) {
        if (a[k] < low || a[k] > high) return false;
        continue;
      }
      const double s = (low - a[k]) / length, t = (high - a[k]) / length;
      from = std::max(from, std::min(s, t) - 1e-9);
      to = std::min(to, std::max(s, t) + 1e-9);
      if (from > to) return false;
    }
    return true;
  }

  const std::vector<Point3>& points_;
  std::vector<std::uint32_t> indices_;
  std::vector<Node> nodes_;
};

}  // namespace bsp2::model
