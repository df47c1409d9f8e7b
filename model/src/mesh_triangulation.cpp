#include "mesh_triangulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory_resource>
#include <tuple>
#include <unordered_map>

namespace bsp2::model {
namespace {

/// Twice the area vector of a cycle, by Newell's sum about its first point.
Point3 area_vector(const std::vector<Point3>& points, std::span<const std::uint32_t> cycle) {
  Point3 sum{};
  const Point3& o = points[cycle[0]];
  for (std::size_t i = 1; i + 1 < cycle.size(); ++i) {
    const Point3 &p = points[cycle[i]], &q = points[cycle[i + 1]];
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      sum[k] += (p[l] - o[l]) * (q[m] - o[m]) - (p[m] - o[m]) * (q[l] - o[l]);
    }
  }
  return sum;
}

double dot(const Point2& a, const Point2& b, const Point2& apex) {
  return (a.u - apex.u) * (b.u - apex.u) + (a.v - apex.v) * (b.v - apex.v);
}

double cross(const Point2& a, const Point2& b, const Point2& apex) {
  return (a.u - apex.u) * (b.v - apex.v) - (a.v - apex.v) * (b.u - apex.u);
}

/// How far the angles at b and d of the quadrilateral a b c d exceed 180 degrees together (a sine): > 0 says
/// that the diagonal b d is better than a c. Ties and noise count as no excess.
bool prefers_other_diagonal(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
  const double sine_b = cross(c, a, b), cosine_b = dot(c, a, b);
  const double sine_d = cross(a, c, d), cosine_d = dot(a, c, d);
  const double excess = -(sine_b * cosine_d + cosine_b * sine_d);
  const double scale = std::fabs(sine_b * cosine_d) + std::fabs(cosine_b * sine_d);
  return excess > 1e-9 * scale;
}

std::uint64_t directed(std::uint32_t from, std::uint32_t to) {
  return std::uint64_t{from} << 32 | to;
}

constexpr std::size_t small_face = 64;  // below it a grid does not pay

}  // namespace

void Triangulator::triangulate(std::span<const std::uint32_t> cycle, std::vector<Triangle>& triangles) {
  if (cycle.size() < 3) return;
  if (cycle.size() == 3) {
    triangles.push_back({cycle[0], cycle[1], cycle[2]});
    return;
  }
  project(cycle);
  if (cycle.size() == 4 && add_quadrilateral(triangles)) return;
  const std::size_t first = triangles.size();
  clip_ears(triangles);
  flip_edges(std::span(triangles).subspan(first));
}

void Triangulator::project(std::span<const std::uint32_t> cycle) {
  const Point3 normal = area_vector(points_, cycle);
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(normal[k]) > std::fabs(normal[axis])) axis = k;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  const auto size = static_cast<std::uint32_t>(cycle.size());
  corners_.resize(size);
  for (std::uint32_t i = 0; i < size; ++i) {
    const Point3& p = points_[cycle[i]];
    corners_[i] = {{p[u], p[v]}, cycle[i], i == 0 ? size - 1 : i - 1, i + 1 == size ? 0 : i + 1, false};
  }
}

/// The common case, without lists. @return false if it takes more care.
bool Triangulator::add_quadrilateral(std::vector<Triangle>& triangles) const {
  const auto& c = corners_;
  std::array<bool, 4> convex{};
  for (int i = 0; i < 4; ++i) convex[i] = orientation(c[(i + 3) % 4].at, c[i].at, c[(i + 1) % 4].at) > 0;
  const bool first = convex[1] && convex[3], second = convex[0] && convex[2];
  if (!first && !second) return false;
  const bool other = !first || (second && prefers_other_diagonal(c[0].at, c[1].at, c[2].at, c[3].at));
  const std::uint32_t a = c[0].vertex, b = c[1].vertex, e = c[2].vertex, d = c[3].vertex;
  if (other) {
    triangles.insert(triangles.end(), {{b, e, d}, {b, d, a}});
  } else {
    triangles.insert(triangles.end(), {{a, b, e}, {a, e, d}});
  }
  return true;
}

void Triangulator::update(std::uint32_t corner) {
  Corner& c = corners_[corner];
  c.reflex = orientation(corners_[c.previous].at, c.at, corners_[c.next].at) <= 0;
}

void Triangulator::clip_ears(std::vector<Triangle>& triangles) {
  auto left = static_cast<std::uint32_t>(corners_.size());
  for (std::uint32_t i = 0; i < left; ++i) update(i);
  build_grid();
  std::uint32_t at = 0, seen = 0;
  int rule = clean;
  while (left > 3) {
    if (!is_ear(at, static_cast<Rule>(rule))) {
      at = corners_[at].next;
      if (++seen > left) ++rule, seen = 0;  // a whole turn without an ear: ask for less
      continue;
    }
    Corner& tip = corners_[at];
    const std::uint32_t a = tip.previous, c = tip.next;
    triangles.push_back({corners_[a].vertex, tip.vertex, corners_[c].vertex});
    corners_[a].next = c;
    corners_[c].previous = a;
    tip.next = tip.previous = at;  // no longer in the cycle
    tip.reflex = false;
    update(a);
    update(c);
    --left;
    at = corners_[c].next;  // passing one over makes better triangles than a fan
    seen = 0;
    rule = clean;
  }
  const Corner& tip = corners_[at];
  triangles.push_back({corners_[tip.previous].vertex, tip.vertex, corners_[tip.next].vertex});
}

bool Triangulator::blocks(const Corner& corner, const Corner& a, const Corner& b, const Corner& c,
                          Rule rule) const {
  if (!corner.reflex || corner.vertex == a.vertex || corner.vertex == b.vertex || corner.vertex == c.vertex)
    return false;
  const int least = rule == clean ? 0 : 1;
  return orientation(c.at, a.at, corner.at) >= least && orientation(a.at, b.at, corner.at) >= least &&
         orientation(b.at, c.at, corner.at) >= least;
}

bool Triangulator::is_ear(std::uint32_t tip, Rule rule) const {
  if (rule >= any) return true;
  const Corner& b = corners_[tip];
  const Corner &a = corners_[b.previous], &c = corners_[b.next];
  if (orientation(a.at, b.at, c.at) < (rule == flat ? 0 : 1)) return false;
  const auto [u_low, u_high] = std::minmax({a.at.u, b.at.u, c.at.u});
  const auto [v_low, v_high] = std::minmax({a.at.v, b.at.v, c.at.v});
  const auto low = cell_of({u_low, v_low}), high = cell_of({u_high, v_high});
  for (int row = low[1]; row <= high[1]; ++row)
    for (int column = low[0]; column <= high[0]; ++column) {
      const std::size_t cell = static_cast<std::size_t>(row) * grid_size_ + column;
      for (std::uint32_t i = cell_begin_[cell]; i < cell_begin_[cell + 1]; ++i) {
        const Corner& corner = corners_[cell_corners_[i]];
        if (corner.at.u < u_low || corner.at.u > u_high || corner.at.v < v_low || corner.at.v > v_high)
          continue;
        if (blocks(corner, a, b, c, rule)) return false;
      }
    }
  return true;
}

std::array<int, 2> Triangulator::cell_of(const Point2& at) const {
  const auto index = [this](double x) { return std::clamp(static_cast<int>(x), 0, grid_size_ - 1); };
  return {index((at.u - grid_low_.u) * grid_scale_.u), index((at.v - grid_low_.v) * grid_scale_.v)};
}

void Triangulator::build_grid() {
  const auto [u_low, u_high] = std::minmax_element(
      corners_.begin(), corners_.end(), [](const Corner& a, const Corner& b) { return a.at.u < b.at.u; });
  const auto [v_low, v_high] = std::minmax_element(
      corners_.begin(), corners_.end(), [](const Corner& a, const Corner& b) { return a.at.v < b.at.v; });
  grid_size_ =
      corners_.size() < small_face ? 1 : static_cast<int>(std::sqrt(static_cast<double>(corners_.size())));
  const auto scale = [this](double extent) {
    return extent > 0 && std::isfinite(grid_size_ / extent) ? grid_size_ / extent : 0.0;
  };
  grid_low_ = {u_low->at.u, v_low->at.v};
  grid_scale_ = {scale(u_high->at.u - grid_low_.u), scale(v_high->at.v - grid_low_.v)};
  cell_begin_.assign(static_cast<std::size_t>(grid_size_) * grid_size_ + 1, 0);
  const auto cell = [this](const Corner& corner) {
    const auto [column, row] = cell_of(corner.at);
    return static_cast<std::size_t>(row) * grid_size_ + column;
  };
  for (const Corner& corner : corners_)
    if (corner.reflex) ++cell_begin_[cell(corner) + 1];
  for (std::size_t i = 1; i < cell_begin_.size(); ++i) cell_begin_[i] += cell_begin_[i - 1];
  cell_corners_.resize(cell_begin_.back());
  std::vector<std::uint32_t> fill(cell_begin_.begin(), cell_begin_.end() - 1);
  for (std::uint32_t i = 0; i < corners_.size(); ++i)
    if (corners_[i].reflex) cell_corners_[fill[cell(corners_[i])]++] = i;
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
    if (orientation(b, c, d) <= 0 || orientation(d, a, b) <= 0 || !prefers_other_diagonal(a, b, c, d))
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
