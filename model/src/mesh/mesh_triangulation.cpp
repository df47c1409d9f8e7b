#include "mesh/mesh_triangulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory_resource>
#include <tuple>
#include <unordered_map>

namespace bsp2::model {
namespace {

Point3 cross_about(const Point3& p, const Point3& q, const Point3& apex) {
  Point3 product{};
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    product[k] = (p[l] - apex[l]) * (q[m] - apex[m]) - (p[m] - apex[m]) * (q[l] - apex[l]);
  }
  return product;
}

/// Twice the area vector of a cycle, by Newell's sum about its first point.
Point3 area_vector(const std::vector<Point3>& points, std::span<const std::uint32_t> cycle) {
  Point3 sum{};
  for (std::size_t i = 1; i + 1 < cycle.size(); ++i) {
    const Point3 part = cross_about(points[cycle[i]], points[cycle[i + 1]], points[cycle[0]]);
    for (int k = 0; k < 3; ++k) sum[k] += part[k];
  }
  return sum;
}

int largest(const Point3& vector) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(vector[k]) > std::fabs(vector[axis])) axis = k;
  return axis;
}

/// Across the largest triangle over the longest extent of a face. OpenSCAD projects along this axis, which
/// decides how a steep face that is not planar is cut.
int axis_of_largest_triangle(const std::vector<Point3>& points, std::span<const std::uint32_t> cycle) {
  std::array<const Point3*, 3> low, high;
  low.fill(&points[cycle[0]]);
  high.fill(&points[cycle[0]]);
  Point3 extent{};
  for (int k = 0; k < 3; ++k) {
    for (const std::uint32_t vertex : cycle) {
      if (points[vertex][k] < (*low[k])[k]) low[k] = &points[vertex];
      if (points[vertex][k] > (*high[k])[k]) high[k] = &points[vertex];
    }
    extent[k] = (*high[k])[k] - (*low[k])[k];
  }
  const int longest = largest(extent);
  Point3 normal{};
  double most = 0;
  for (const std::uint32_t vertex : cycle) {
    const Point3 candidate = cross_about(*low[longest], points[vertex], *high[longest]);
    const double length =
        candidate[0] * candidate[0] + candidate[1] * candidate[1] + candidate[2] * candidate[2];
    if (length > most) most = length, normal = candidate;
  }
  return largest(normal);
}

double dot_about(const Point2& a, const Point2& b, const Point2& apex) {
  return (a.u - apex.u) * (b.u - apex.u) + (a.v - apex.v) * (b.v - apex.v);
}

double cross_about(const Point2& a, const Point2& b, const Point2& apex) {
  return (a.u - apex.u) * (b.v - apex.v) - (a.v - apex.v) * (b.u - apex.u);
}

/// By how much the angles at b and d of the quadrilateral a b c d exceed 180 degrees together: if they do,
/// the diagonal b d is better than a c. If they do so by less than `indifference`, the diagonal that is there
/// stays.
double excess_of_angles(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
  const double sine_b = cross_about(c, a, b), cosine_b = dot_about(c, a, b);
  const double sine_d = cross_about(a, c, d), cosine_d = dot_about(a, c, d);
  return std::atan2(-(sine_b * cosine_d + cosine_b * sine_d), sine_b * sine_d - cosine_b * cosine_d);
}

constexpr double indifference = 0.01;  // OpenSCAD's

/// The order of the sweep.
bool is_before(const Point2& a, const Point2& b) { return a.u < b.u || (a.u == b.u && a.v < b.v); }

std::uint64_t directed(std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; }

}  // namespace

void Triangulator::triangulate(std::span<const std::uint32_t> cycle, std::vector<Triangle>& triangles) {
  if (cycle.size() < 3) return;
  if (cycle.size() == 3) {
    triangles.push_back({cycle[0], cycle[1], cycle[2]});
    return;
  }
  const Point3 area = area_vector(points_, cycle);
  project(cycle, axis_of_largest_triangle(points_, cycle), area);
  bool convex = is_convex();
  if (!convex && !is_arrowhead()) {  // a face that is far from planar may even cross itself there
    project(cycle, largest(area), area);
    convex = is_convex();
  }
  if (convex && cycle.size() == 4) {
    add_convex_quadrilateral(triangles);
    return;
  }
  const std::size_t first = triangles.size();
  convex ? zip_chains(triangles) : clip_ears(triangles);
  flip_edges(std::span(triangles).subspan(first));
}

void Triangulator::project(std::span<const std::uint32_t> cycle, int axis, const Point3& area) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double side = area[axis] < 0 ? -1 : 1;
  const auto size = static_cast<std::uint32_t>(cycle.size());
  corners_.resize(size);
  for (std::uint32_t i = 0; i < size; ++i) {
    const Point3& p = points_[cycle[i]];
    corners_[i] = {
        {p[u], side * p[v]}, cycle[i], i == 0 ? size - 1 : i - 1, i + 1 == size ? 0 : i + 1, false};
  }
}

/// Strictly, and once around: where it turns from right to left it does so once.
bool Triangulator::is_convex() const {
  int turns = 0;
  for (const Corner& c : corners_) {
    const Corner &before = corners_[c.previous], &after = corners_[c.next];
    if (orientation(before.at, c.at, after.at) <= 0) return false;
    turns += is_before(c.at, before.at) != is_before(after.at, c.at) ? 1 : 0;
  }
  return turns == 2;
}

/// A quadrilateral with one reflex corner. It has but one diagonal.
bool Triangulator::is_arrowhead() const {
  if (corners_.size() != 4) return false;
  return std::ranges::count_if(corners_, [this](const Corner& c) { return is_reflex(c); }) == 1;
}

/// The common case, without lists. A planar rectangle is cut alike from both sides: two that coincide cancel.
void Triangulator::add_convex_quadrilateral(std::vector<Triangle>& triangles) const {
  const auto& c = corners_;
  const std::uint32_t a = c[0].vertex, b = c[1].vertex, e = c[2].vertex, d = c[3].vertex;
  double excess = excess_of_angles(c[0].at, c[1].at, c[2].at, c[3].at);
  if (std::fabs(excess) < indifference) {
    if (orientation(points_[a], points_[b], points_[e], points_[d]) != 0) return zip_chains(triangles);
    excess = std::min(points_[b], points_[d]) < std::min(points_[a], points_[e]) ? 1 : -1;
  }
  if (excess > 0) {
    triangles.insert(triangles.end(), {{b, e, d}, {b, d, a}});
  } else {
    triangles.insert(triangles.end(), {{a, b, e}, {a, e, d}});
  }
}

/// Two chains lead from the last corner to the first one. Each corner, from last to first, forms a triangle
/// with the newest corner of either chain. So triangulates OpenSCAD, before its flips: it matters where these
/// have no preference, as in rectangles.
void Triangulator::zip_chains(std::vector<Triangle>& triangles) const {
  const auto last = static_cast<std::uint32_t>(
      std::max_element(corners_.begin(), corners_.end(),
                       [](const Corner& a, const Corner& b) { return is_before(a.at, b.at); }) -
      corners_.begin());
  std::uint32_t upper = last,
                lower = last;  // the upper chain goes on with the cycle, the lower one against it
  for (std::size_t left = corners_.size() - 1; left > 0; --left) {
    const std::uint32_t above = corners_[upper].next, below = corners_[lower].previous;
    const bool is_upper = is_before(corners_[below].at, corners_[above].at);
    const std::uint32_t corner = is_upper ? above : below;
    if (upper != lower)
      triangles.push_back({corners_[lower].vertex, corners_[upper].vertex, corners_[corner].vertex});
    (is_upper ? upper : lower) = corner;
  }
}

bool Triangulator::is_reflex(const Corner& c) const {
  return orientation(corners_[c.previous].at, c.at, corners_[c.next].at) <= 0;
}

void Triangulator::clip_ears(std::vector<Triangle>& triangles) {
  auto left = static_cast<std::uint32_t>(corners_.size());
  start_search();
  std::uint32_t at = 0;
  while (left > 3) {
    const std::uint32_t tip = find_ear(at);
    triangles.push_back(triangle_at(tip));
    at = corners_[corners_[tip].next].next;  // passing one over makes better triangles than a fan
    clip(tip);
    --left;
  }
  triangles.push_back(triangle_at(at));
}

Triangle Triangulator::triangle_at(std::uint32_t tip) const {
  const Corner& c = corners_[tip];
  return {corners_[c.previous].vertex, c.vertex, corners_[c.next].vertex};
}

/// The first one from here on, by the rule that asks the most. One turn after another asks for less, and
/// begins a corner later.
std::uint32_t Triangulator::find_ear(std::uint32_t from) {
  for (int rule = clean; rule < any; ++rule, from = corners_[from].next) {
    IndexSet& candidates = candidates_[static_cast<std::size_t>(rule)];
    for (int turn = 0; turn < 2; ++turn)
      for (std::uint32_t i = candidates.next(turn == 0 ? from : 0); i != IndexSet::none;
           i = candidates.next(i + 1)) {
        if (is_ear(i, static_cast<Rule>(rule))) return i;
        candidates.erase(i);
      }
  }
  return from;
}

/// Takes a corner out of the cycle. What was no ear may be one now, if it is beside it, or if it waited for
/// one of these to stop being reflex.
void Triangulator::clip(std::uint32_t tip) {
  const std::uint32_t a = corners_[tip].previous, c = corners_[tip].next;
  corners_[a].next = c;
  corners_[c].previous = a;
  corners_[tip].next = corners_[tip].previous = tip;  // no longer in the cycle
  for (IndexSet& candidates : candidates_) candidates.erase(tip);
  set_reflex(tip, false);
  for (const std::uint32_t beside : {a, c}) {
    set_reflex(beside, is_reflex(corners_[beside]));
    for (IndexSet& candidates : candidates_) candidates.insert(beside);
  }
}

void Triangulator::set_reflex(std::uint32_t corner, bool reflex) {
  if (corners_[corner].reflex == reflex) return;
  corners_[corner].reflex = reflex;
  blockers_.count(corner, reflex ? 1 : -1);
  if (reflex) return;
  for (std::uint32_t i = first_waiter_[corner]; i != IndexSet::none; i = waiters_[i].next)
    if (const auto [waiter, rule, next] = waiters_[i]; corners_[waiter].next != waiter)
      candidates_[rule].insert(waiter);
  first_waiter_[corner] = IndexSet::none;
}

bool Triangulator::blocks(const Corner& corner, const Corner& a, const Corner& b, const Corner& c,
                          Rule rule) const {
  if (!corner.reflex || corner.vertex == a.vertex || corner.vertex == b.vertex || corner.vertex == c.vertex)
    return false;
  const int least = rule == clean ? 0 : 1;
  return orientation(c.at, a.at, corner.at) >= least && orientation(a.at, b.at, corner.at) >= least &&
         orientation(b.at, c.at, corner.at) >= least;
}

/// If not, for another corner: waits for that one.
bool Triangulator::is_ear(std::uint32_t tip, Rule rule) {
  const Corner& b = corners_[tip];
  const Corner &a = corners_[b.previous], &c = corners_[b.next];
  if (orientation(a.at, b.at, c.at) < (rule == flat ? 0 : 1)) return false;
  const auto blocker = blockers_.find_in({a.at, b.at, c.at}, rule == clean, [&](std::uint32_t corner) {
    return blocks(corners_[corner], a, b, c, rule);
  });
  if (!blocker) return true;
  waiters_.push_back({tip, rule, first_waiter_[*blocker]});
  first_waiter_[*blocker] = static_cast<std::uint32_t>(waiters_.size() - 1);
  return false;
}

void Triangulator::start_search() {
  const auto size = static_cast<std::uint32_t>(corners_.size());
  std::vector<PlaneTree::Entry> reflex;
  for (std::uint32_t i = 0; i < size; ++i) {
    corners_[i].reflex = is_reflex(corners_[i]);
    if (corners_[i].reflex) reflex.push_back({corners_[i].at, i});
  }
  blockers_.build(std::move(reflex), size);
  for (IndexSet& candidates : candidates_) candidates.fill(size);
  first_waiter_.assign(size, IndexSet::none);
  waiters_.clear();
}

/// Lawson's flips. A budget, not a proof, ends them: the comparison of angles is rounded.
void Triangulator::flip_edges(std::span<Triangle> triangles) const {
  std::array<std::byte, 16384> memory;  // enough for a small face; a larger one gets more from the heap
  std::pmr::monotonic_buffer_resource resource(memory.data(), memory.size());
  std::pmr::unordered_map<std::uint32_t, Point2> position(&resource);
  for (const Corner& corner : corners_) position.emplace(corner.vertex, corner.at);
  struct Half {
    std::uint32_t triangle;
    bool unique;
  };
  std::pmr::unordered_map<std::uint64_t, Half> halves(&resource);
  halves.reserve(3 * triangles.size());
  std::pmr::vector<std::uint64_t> todo(&resource);
  todo.reserve(3 * triangles.size());
  const auto enter = [&](std::uint32_t t) {
    for (int k = 0; k < 3; ++k) {
      const auto [entry, fresh] =
          halves.try_emplace(directed(triangles[t][k], triangles[t][(k + 1) % 3]), Half{t, true});
      if (!fresh) entry->second.unique = false;
    }
  };
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    enter(t);
    for (int k = 0; k < 3; ++k) todo.push_back(directed(triangles[t][k], triangles[t][(k + 1) % 3]));
  }
  for (std::size_t budget = 8 * triangles.size(), done = 0; done < todo.size() && budget > 0; ++done) {
    const auto from = static_cast<std::uint32_t>(todo[done] >> 32),
               to = static_cast<std::uint32_t>(todo[done]);
    const auto one = halves.find(directed(from, to)), two = halves.find(directed(to, from));
    if (one == halves.end() || two == halves.end() || !one->second.unique || !two->second.unique) continue;
    const std::uint32_t s = one->second.triangle, t = two->second.triangle;
    const auto apex = [&](const Triangle& triangle) {
      for (const std::uint32_t v : triangle)
        if (v != from && v != to) return v;
      return from;
    };
    const std::uint32_t left = apex(triangles[s]), right = apex(triangles[t]);
    if (left == right || left == from || right == from || halves.contains(directed(left, right)) ||
        halves.contains(directed(right, left)))
      continue;
    const Point2 &a = position[from], &b = position[right], &c = position[to], &d = position[left];
    if (orientation(b, c, d) <= 0 || orientation(d, a, b) <= 0 ||
        !(excess_of_angles(a, b, c, d) >= indifference))
      continue;
    halves.erase(directed(from, to));
    halves.erase(directed(to, from));
    triangles[s] = {right, to, left};
    triangles[t] = {left, from, right};
    halves[directed(right, left)] = {t, true};  // t: left from right, so right -> left
    halves[directed(left, right)] = {s, true};  // s: right to left, so left -> right
    for (const auto& [x, y, owner] : {std::tuple(right, to, s), std::tuple(to, left, s),
                                      std::tuple(left, from, t), std::tuple(from, right, t)}) {
      if (const auto half = halves.find(directed(x, y)); half != halves.end() && half->second.unique)
        half->second.triangle = owner;
      todo.push_back(directed(x, y));
    }
    --budget;
  }
}

}  // namespace bsp2::model
