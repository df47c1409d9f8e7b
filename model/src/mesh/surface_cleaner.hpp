#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bsp2/model/mesh/cleaning.hpp"
#include "mesh/predicates.hpp"

namespace bsp2::model::cleaning {

using geometry::TriangleSurface;
using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;

inline constexpr Index none = std::numeric_limits<Index>::max();

inline double length_of(const Point3& v) { return std::sqrt(dot(v, v)); }

inline double farthest_of(const Point3& p) {
  return std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
}

/// A triangle by its three corners.
struct Shape {
  std::array<Point3, 3> corners;

  [[nodiscard]] Point3 normal() const {
    return cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
  }
  /// The side across from corner k.
  [[nodiscard]] double side(std::size_t k) const {
    return length_of(minus(corners[(k + 2) % 3], corners[(k + 1) % 3]));
  }
  /// The corner across from the longest side.
  [[nodiscard]] std::size_t apex() const {
    std::size_t apex = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (side(k) > side(apex)) apex = k;
    return apex;
  }
  [[nodiscard]] double thickness() const {
    const double longest = side(apex());
    return longest > 0 ? length_of(normal()) / longest : 0;
  }
  [[nodiscard]] double farthest() const {
    return std::max({farthest_of(corners[0]), farthest_of(corners[1]), farthest_of(corners[2])});
  }
  /// How far a point is from the plane.
  [[nodiscard]] double distance(const Point3& point) const {
    const Point3 n = normal();
    const double length = length_of(n);
    return length > 0 ? std::fabs(dot(minus(point, corners[0]), n)) / length : 0;
  }
};

inline double distance_to_segment(const Point3& point, const Point3& a, const Point3& b) {
  const Point3 along = minus(b, a), to = minus(point, a);
  const double square = dot(along, along);
  const double t = square > 0 ? std::clamp(dot(to, along) / square, 0.0, 1.0) : 0;
  Point3 rest;
  for (std::size_t k = 0; k < 3; ++k) rest[k] = to[k] - t * along[k];
  return length_of(rest);
}

/// One way through a surface. Deterministic: what is shortest goes first, of equal ones the first.
class SurfaceCleaner {
 public:
  /// @param fixed corners at which nothing may change.
  SurfaceCleaner(const TriangleSurface& surface, const CleanLength& length, const std::vector<bool>& fixed)
      : points_(surface.points),
        triangles_(surface.triangles),
        owner_(surface.owner),
        closes_parts_(surface.closes_parts),
        length_(length),
        fixed_(fixed),
        is_touched_(points_.size()),
        became_(points_.size(), none),
        reach_(points_.size()),
        bent_(triangles_.size()),
        is_changed_(triangles_.size()),
        first_(points_.size() + 1) {
    list_corners();
    for (Index i = 0; i < triangles_.size(); ++i) list(i);
    patience_ = 64 * (edges_.size() + slivers_.size()) + 1024;
  }

  void run() {
    constexpr int most_rounds = 8;  // each begins where the one before has changed something
    for (int round = 0; round < most_rounds; ++round) {
      take_all_listed();
      if (!leave_out_corners()) break;
    }
  }

  [[nodiscard]] const Cleaning& cleaning() const { return cleaning_; }
  /// The corner that one of the surface has become part of.
  [[nodiscard]] Index representative(Index point) const {
    while (became_[point] != none) point = became_[point];
    return point;
  }
  [[nodiscard]] const Point3& point(Index i) const { return points_[i]; }
  /// Triangles, of which some may be gone.
  [[nodiscard]] std::size_t triangles() const { return triangles_.size(); }
  [[nodiscard]] bool is_there(Index i) const { return triangles_[i][0] != none; }
  [[nodiscard]] const Triangle& triangle(Index i) const { return triangles_[i]; }
  [[nodiscard]] std::int32_t owner(Index i) const { return owner_[i]; }

  /// @param changed gets the triangles of it that are not of the surface, by their numbers.
  TriangleSurface result(std::vector<Index>& changed) {
    TriangleSurface result;
    result.closes_parts = closes_parts_;
    std::vector<Index> number(points_.size(), none);
    for (Index i = 0; i < triangles_.size(); ++i) {
      if (!is_there(i)) continue;
      for (const Index corner : triangles_[i]) number[corner] = 0;
    }
    for (Index i = 0; i < points_.size(); ++i) {
      if (number[i] == none) continue;
      number[i] = static_cast<Index>(result.points.size());
      result.points.push_back(points_[i]);
    }
    for (Index i = 0; i < triangles_.size(); ++i) {
      if (!is_there(i)) continue;
      const Triangle& t = triangles_[i];
      if (is_changed_[i]) changed.push_back(static_cast<Index>(result.triangles.size()));
      result.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
      result.owner.push_back(owner_[i]);
      cleaning_.left += remaining_faults(i);
    }
    return result;
  }

 private:
  struct ShortEdge {
    double length;
    Index from, to;
    bool operator<(const ShortEdge& other) const {  // the shortest one first
      return std::tie(length, from, to) > std::tie(other.length, other.from, other.to);
    }
  };

  std::vector<Point3> points_;
  std::vector<Triangle> triangles_;
  std::vector<std::int32_t> owner_;
  bool closes_parts_;
  CleanLength length_;
  const std::vector<bool>& fixed_;
  std::vector<bool> is_touched_;
  std::vector<Index> became_;  // another corner
  std::vector<double> reach_;  // of each corner: how far those are that have become it
  std::vector<double> bent_;   // of each triangle: how far it may be from where it was, besides its corners
  std::vector<bool> is_changed_;  // of each triangle
  // Triangles at each corner: of corner c those of list_ from first_[c] on, as long as nothing has changed
  // there.
  std::vector<Index> first_, list_;
  std::unordered_map<Index, std::vector<Index>> around_;  // else these; some may be gone
  std::priority_queue<ShortEdge> edges_;
  std::vector<Index> slivers_;
  std::unordered_map<Index, int> waits_;  // of slivers for others
  static constexpr int most_waits = 4;
  std::size_t patience_ = 0;
  Cleaning cleaning_;

  [[nodiscard]] double limit_at(Index corner) const { return length_.at(farthest_of(points_[corner])); }
  [[nodiscard]] bool is_thin(const Shape& s) const { return s.thickness() < length_.at(s.farthest()); }
  void remove(Index i) {
    for (const Index corner : triangles_[i]) is_touched_[corner] = true;
    triangles_[i][0] = none;
  }
  [[nodiscard]] Shape shape(const Triangle& t) const {
    return {{points_[t[0]], points_[t[1]], points_[t[2]]}};
  }
  [[nodiscard]] static bool has(const Triangle& t, Index corner) {
    return t[0] == corner || t[1] == corner || t[2] == corner;
  }
  [[nodiscard]] bool is_fixed(Index i) const {
    return std::ranges::any_of(triangles_[i], [&](Index corner) { return fixed_[corner]; });
  }
  void list_corners() {
    for (const Triangle& t : triangles_)
      for (const Index corner : t) ++first_[corner + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    list_.resize(first_.back());
    std::vector<Index> next(first_.begin(), first_.end() - 1);
    for (Index i = 0; i < triangles_.size(); ++i)
      for (const Index corner : triangles_[i]) list_[next[corner]++] = i;
  }
  /// Those around a corner, of which some may be gone, or be there twice.
  [[nodiscard]] std::span<const Index> listed(Index corner) const {
    if (const auto found = around_.find(corner); found != around_.end()) return found->second;
    return std::span(list_).subspan(first_[corner], first_[corner + 1] - first_[corner]);
  }
  std::vector<Index>& around(Index corner) {
    const auto [at, is_new] = around_.try_emplace(corner);
    if (is_new) at->second.assign(list_.begin() + first_[corner], list_.begin() + first_[corner + 1]);
    return at->second;
  }
  [[nodiscard]] std::vector<Index> star(Index corner) {
    auto& all = around(corner);
    std::erase_if(all, [&](Index i) { return !is_there(i) || !has(triangles_[i], corner); });
    std::ranges::sort(all);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  /// Lists what is wrong with a triangle.
  void list(Index i) {
    const Triangle& t = triangles_[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = std::min(t[k], t[(k + 1) % 3]), b = std::max(t[k], t[(k + 1) % 3]);
      if (const double length = length_of(minus(points_[a], points_[b]));
          length < std::max(limit_at(a), limit_at(b)))
        edges_.push({length, a, b});
    }
    if (is_thin(shape(t))) slivers_.push_back(i);
  }
  [[nodiscard]] std::uint64_t remaining_faults(Index i) const {
    if (!is_thin(shape(triangles_[i]))) return 0;
    const auto other = other_side(i);
    return other && *other < i ? 0 : 1;
  }

  // --- between parts ---

  /// Whether two triangles have the same corners and look in opposite directions.
  [[nodiscard]] bool are_opposite(Index i, Index other) const {
    const Triangle &t = triangles_[i], &o = triangles_[other];
    if (!has(o, t[0]) || !has(o, t[1]) || !has(o, t[2])) return false;
    const auto at = static_cast<std::size_t>(std::ranges::find(o, t[0]) - o.begin());
    return o[(at + 1) % 3] == t[2];
  }
  /// The first triangle opposite to one, of the same part or of another one, if each is closed by itself.
  [[nodiscard]] std::optional<Index> opposite(Index i, bool of_same_part) const {
    std::span<const Index> fewest;
    for (const Index corner : triangles_[i])
      if (const auto all = listed(corner); fewest.empty() || all.size() < fewest.size()) fewest = all;
    std::optional<Index> first;
    for (const Index other : fewest)
      if (other != i && is_there(other) && (!first || other < *first) && are_opposite(i, other) &&
          (!closes_parts_ || (owner_[other] == owner_[i]) == of_same_part))
        first = other;
    return first;
  }
  /// Where each part is closed by itself: the triangle of the part on the other side of this one.
  [[nodiscard]] std::optional<Index> other_side(Index i) const {
    return closes_parts_ ? opposite(i, false) : std::nullopt;
  }

  void take_all_listed() {
    while (patience_ > 0 && !(edges_.empty() && slivers_.empty())) {
      --patience_;
      if (!edges_.empty()) {
        const ShortEdge edge = edges_.top();
        edges_.pop();
        if (became_[edge.from] == none && became_[edge.to] == none) merge(edge.from, edge.to, edge.length);
      } else {
        const Index i = slivers_.back();
        slivers_.pop_back();
        if (is_there(i) && is_thin(shape(triangles_[i]))) take_in(i);
      }
    }
  }

  // --- corners that become one ---

  void merge(Index a, Index b, double length) {
    const auto cost_of_a = cost_of_moving(a, b, length), cost_of_b = cost_of_moving(b, a, length);
    if (!cost_of_a && !cost_of_b) return;
    const bool moves_a = cost_of_a && (!cost_of_b || *cost_of_a < *cost_of_b);
    const Index from = moves_a ? a : b, to = moves_a ? b : a;
    reach_[to] = std::max(reach_[to], reach_[from] + length);
    cleaning_.moved = std::max(cleaning_.moved, reach_[to]);
    ++cleaning_.merged_points;
    collapse(from, to);
  }

  /// By how much faces turn away if a corner goes to another one; nothing if it may not.
  [[nodiscard]] std::optional<double> cost_of_moving(Index from, Index to, double distance) {
    if (fixed_[from] || fixed_[to] || reach_[from] + distance > limit_at(to)) return std::nullopt;
    double cost = 0;
    bool is_edge = false;
    for (const Index i : star(from)) {
      const Triangle& t = triangles_[i];
      if (has(t, to)) {
        is_edge = true;
        continue;
      }
      const Shape before = shape(t), after = moved(t, from, to);
      if (!may_become(before, after)) return std::nullopt;
      if (!is_thin(before)) cost = std::max(cost, before.distance(points_[to]));
    }
    return is_edge ? std::optional(cost) : std::nullopt;
  }
  [[nodiscard]] Shape moved(const Triangle& t, Index from, Index to) const {
    Shape result = shape(t);
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] == from) result.corners[k] = points_[to];
    return result;
  }
  /// No triangle that is one turns over. Slivers have no direction of their own.
  [[nodiscard]] bool may_become(const Shape& before, const Shape& after) const {
    constexpr double least_cosine = 0.1;
    const Point3 m = before.normal(), n = after.normal();
    if (is_thin(before) && is_thin(after)) return true;
    return dot(m, n) > least_cosine * length_of(m) * length_of(n);
  }

  void collapse(Index from, Index to) {
    for (const Index i : star(from)) {
      Triangle& t = triangles_[i];
      if (has(t, to)) {
        remove(i);
        continue;
      }
      for (Index& corner : t)
        if (corner == from) corner = to;
      is_changed_[i] = true;
      around(to).push_back(i);
      for (const Index corner : t) is_touched_[corner] = true;
    }
    became_[from] = to;
    around(from).clear();
    is_touched_[to] = true;
    for (const Index i : star(to))
      if (is_there(i) && !cancel(i)) list(i);
  }

  /// Removes a triangle with another one that has the same corners and looks the other way: nothing is
  /// between them. Where each part is closed by itself, those of two parts stay.
  bool cancel(Index i) {
    const auto other = opposite(i, true);
    if (!other) return false;
    remove(*other);
    remove(i);
    return true;
  }

  // --- slivers ---

  /// Lets the neighbours at its longest side have a triangle, and that of another part on its other side.
  void take_in(Index sliver) {
    if (is_fixed(sliver)) return;
    const Shape thin = shape(triangles_[sliver]);
    const std::size_t k = thin.apex();
    const Triangle t = triangles_[sliver];
    const Index b = t[k], c = t[(k + 1) % 3], a = t[(k + 2) % 3];
    const double thickness = thin.thickness();
    const auto other = other_side(sliver);
    std::vector<Index> neighbours;
    for (const Index i : star(a))
      if (i != sliver && i != other && has(triangles_[i], c)) neighbours.push_back(i);
    for (const Index i : neighbours)
      if (has(triangles_[i], b)) {  // the two are one and its opposite, or the surface has it twice
        if (!cancel(sliver)) return;
        ++cleaning_.slivers;
        return;
      }
    const double bend = bent_[sliver] + thickness;
    for (const Index i : neighbours) {
      if (is_later(i, a, c) && waits_[sliver]++ < most_waits) {
        slivers_.push_back(sliver);
        slivers_.push_back(i);
        return;
      }
      if (!may_be_split(i, a, c, b, bend)) return;
    }
    remove(sliver);
    if (other) remove(*other);
    ++cleaning_.slivers;
    for (const Index i : neighbours) split(i, a, c, b, bend);
  }

  [[nodiscard]] bool may_be_split(Index i, Index a, Index c, Index b, double bend) const {
    if (is_fixed(i) || bent_[i] + bend > limit_at(b)) return false;
    const Triangle& t = triangles_[i];
    const Shape before = shape(t);
    if (!is_thin(before))
      for (const Index end : {a, c})
        if (!may_become(before, moved(t, end, b))) return false;
    return !is_later(i, a, c);
  }
  /// Whether it is a sliver that has another longest side: it goes first, so that sides get shorter.
  [[nodiscard]] bool is_later(Index i, Index a, Index c) const {
    const Triangle& t = triangles_[i];
    const Shape s = shape(t);
    const std::size_t k = s.apex();
    return is_thin(s) && (t[k] == a || t[k] == c);
  }
  void split(Index i, Index a, Index c, Index b, double bend) {
    const Triangle t = triangles_[i];
    Triangle first = t, second = t;
    std::ranges::replace(first, c, b);
    std::ranges::replace(second, a, b);
    const auto added = static_cast<Index>(triangles_.size());
    triangles_[i] = first;
    triangles_.push_back(second);
    owner_.push_back(owner_[i]);
    bent_[i] += bend;
    bent_.push_back(bent_[i]);
    is_changed_[i] = true;
    is_changed_.push_back(true);
    for (const Index corner : second) around(corner).push_back(added);
    around(b).push_back(i);
    for (const Index each : {i, added}) {
      for (const Index corner : triangles_[each]) is_touched_[corner] = true;
      if (is_there(each) && !cancel(each)) list(each);
    }
  }

  // --- corners in faces and straight edges ---

  /// Where a corner goes that is left out, and how far its triangles are then from where they were.
  struct LeftOut {
    Index to;
    double bend;
  };

  /// @return whether there were any around what has changed.
  bool leave_out_corners() {
    bool is_changed = false;
    for (Index corner = 0; corner < points_.size(); ++corner) {
      if (!is_touched_[corner] || became_[corner] != none) continue;
      is_touched_[corner] = false;
      if (fixed_[corner]) continue;
      if (const auto way = way_to_leave_out(corner)) {
        ++cleaning_.left_out;
        for (const Index i : star(corner)) bent_[i] = way->bend;
        collapse(corner, way->to);
        is_changed = true;
      }
    }
    return is_changed;
  }

  /// The ends of the edges at a corner that must stay: between parts, or where other than two triangles meet,
  /// of which the two sides of one between parts are one.
  [[nodiscard]] std::vector<Index> lasting_edges(Index corner, const std::vector<Index>& triangles) const {
    using Parts = std::pair<std::int32_t, std::int32_t>;  // on the sides of a triangle, the lower one first
    struct Sides {
      int count = 0;
      Parts parts;
      bool differs = false;
    };
    std::map<Index, Sides> sides;
    for (const Index i : triangles) {
      const auto other = other_side(i);
      if (other && *other < i) continue;
      const Parts parts = std::minmax(owner_[i], other ? owner_[*other] : owner_[i]);
      for (const Index end : triangles_[i]) {
        if (end == corner) continue;
        Sides& s = sides[end];
        if (s.count++ == 0) s.parts = parts;
        s.differs = s.differs || s.parts != parts;
      }
    }
    std::vector<Index> ends;
    for (const auto& [end, s] : sides)
      if (s.count != 2 || s.differs) ends.push_back(end);
    return ends;
  }

  [[nodiscard]] std::optional<LeftOut> way_to_leave_out(Index corner) {
    const std::vector<Index> triangles = star(corner);
    if (triangles.empty()) return std::nullopt;
    double bent = 0;
    for (const Index i : triangles) bent = std::max(bent, bent_[i]);
    std::vector<Index> ends = lasting_edges(corner, triangles);
    if (!ends.empty()) {
      if (ends.size() != 2) return std::nullopt;
      bent += distance_to_segment(points_[corner], points_[ends[0]], points_[ends[1]]);
    } else {
      for (const Index i : triangles)
        for (const Index end : triangles_[i])
          if (end != corner) ends.push_back(end);
      std::ranges::sort(ends);
      ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    }
    for (const Index end : ends) {
      const auto away = way_from_planes(end, corner, triangles);
      if (away && bent + *away <= limit_at(corner) / 2) return LeftOut{end, bent + *away};
    }
    return std::nullopt;
  }

  /// How far from their planes a corner's triangles come if it goes to the other end of an edge; nothing if
  /// they turn.
  [[nodiscard]] std::optional<double> way_from_planes(Index end, Index corner,
                                                      const std::vector<Index>& triangles) const {
    if (fixed_[end]) return std::nullopt;
    constexpr double least_cosine = 0.999;
    double away = 0;
    for (const Index i : triangles) {
      const Triangle& t = triangles_[i];
      if (has(t, end)) continue;
      const Shape before = shape(t), after = moved(t, corner, end);
      if (is_thin(before) || is_thin(after)) return std::nullopt;
      away = std::max({away, before.distance(points_[end]), after.distance(points_[corner])});
      const Point3 m = before.normal(), n = after.normal();
      if (dot(m, n) < least_cosine * length_of(m) * length_of(n)) return std::nullopt;
    }
    return away;
  }
};

}  // namespace bsp2::model::cleaning
