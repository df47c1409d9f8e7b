#include "outputs/single_precision.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace bsp2::io {
namespace {

using geometry::TriangleSurface;
using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;
using Point = std::array<double, 3>;
using SinglePoint = std::array<float, 3>;

constexpr Index none = std::numeric_limits<Index>::max();

SinglePoint single(const Point& p) {
  return {static_cast<float>(p[0]) + 0.0F, static_cast<float>(p[1]) + 0.0F,
          static_cast<float>(p[2]) + 0.0F};  // -0 is 0
}

Point wide(const SinglePoint& p) { return {p[0], p[1], p[2]}; }

/// Six times the volume of the tetrahedron above a triangle.
double determinant(const Point& o, const Point& a, const Point& b, const Point& c) {
  Point u, v, w;
  for (std::size_t k = 0; k < 3; ++k) u[k] = a[k] - o[k], v[k] = b[k] - o[k], w[k] = c[k] - o[k];
  return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

/// Whether doubles sum up to nothing, exactly: the sum is kept as doubles of which each is the rounding error
/// of the next. Source: Shewchuk, "Adaptive precision floating-point arithmetic" (1997), grow-expansion.
bool cancel(const std::array<double, 6>& terms) {
  std::array<double, 6> errors;
  std::size_t count = 0;
  for (double sum : terms) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double next = sum + errors[i], back = next - sum;
      const double error = (sum - (next - back)) + (errors[i] - back);
      if (error != 0) errors[kept++] = error;
      sum = next;
    }
    if (sum != 0) errors[kept++] = sum;
    count = kept;
  }
  return count == 0;
}

/// How flat a triangle is.
enum class Flatness : std::uint8_t {
  no,
  apparent,  ///< doubles find no area, beginning with one of its corners
  exact
};

/// Exact: the product of two floats is a double.
bool are_on_a_line(const Point& a, const Point& b, const Point& c) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    if (!cancel({b[k] * c[l], -b[l] * c[k], a[l] * c[k], -a[k] * c[l], a[k] * b[l], -a[l] * b[k]}))
      return false;
  }
  return true;
}

Flatness flatness_of(const SinglePoint& p, const SinglePoint& q, const SinglePoint& r) {
  constexpr double error = 1e-15;  // of the difference of two products of differences, relative to the square
                                   // of their lengths, and more
  std::array<Point, 3> corners{wide(p), wide(q), wide(r)};
  bool is_apparent = false;
  for (int turn = 0; turn < 3; ++turn) {
    const auto& [a, b, c] = corners;
    double area = 0, length = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      const double u = b[k] - a[k], v = c[k] - a[k];
      area = std::max(area, std::fabs(u * (c[l] - a[l]) - (b[l] - a[l]) * v));
      length = std::max({length, std::fabs(u), std::fabs(v)});
    }
    if (area > 4 * error * length * length)
      return Flatness::no;  // seen from the other corners it is as large, and they are no farther apart
    is_apparent = is_apparent || area == 0;
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
  }
  if (are_on_a_line(corners[0], corners[1], corners[2])) return Flatness::exact;
  return is_apparent ? Flatness::apparent : Flatness::no;
}

/// Which of three different points on a line is between the others.
std::size_t middle_of(const std::array<const SinglePoint*, 3>& points) {
  std::size_t axis = 0;
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax({(*points[0])[k], (*points[1])[k], (*points[2])[k]});
    if (const double length = double{high} - double{low}; length > longest) {
      longest = length;
      axis = k;
    }
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return (*points[a])[axis] < (*points[b])[axis]; });
  return order[1];
}

/// Makes one of points that are equal.
class Welder {
 public:
  explicit Welder(std::size_t count) : slots_(std::bit_ceil(2 * count + 1), none) {}

  /// @return the number of an equal one, which may be the point itself.
  Index add(const SinglePoint& point, std::vector<SinglePoint>& points) {
    for (std::size_t slot = hash(point) & (slots_.size() - 1);; slot = (slot + 1) & (slots_.size() - 1)) {
      if (slots_[slot] == none) {
        slots_[slot] = static_cast<Index>(points.size());
        points.push_back(point);
      }
      if (points[slots_[slot]] == point) return slots_[slot];
    }
  }

 private:
  std::vector<Index> slots_;

  static std::size_t hash(const SinglePoint& point) {
    std::uint64_t h = 0;
    for (const float x : point) {
      h = (h ^ std::bit_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15U;
      h ^= h >> 32;
    }
    return h;
  }
};

/// Takes out the triangles that are marked as gone.
void remove_gone(SingleSurface& surface) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    if (surface.triangles[i][0] == none) continue;
    surface.triangles[kept] = surface.triangles[i];
    surface.owner[kept++] = surface.owner[i];
  }
  surface.triangles.resize(kept);
  surface.owner.resize(kept);
}

/// Removes the triangles without area from a surface that has them.
///
/// A triangle a b c whose corner b is between a and c has the neighbour a c d at its longest side. Both are
/// replaced by a b d and b c d, which have the same outline and fill the same area. They have area if the
/// neighbour has. If it has none, it is replaced first where its own longest side is longer, and where it is
/// the same side, the longest sides of what comes are shorter. So this ends. Triangles that only doubles take
/// for flat go the same way, so many times: readers have nothing but doubles.
class FlatRemover {
 public:
  FlatRemover(SingleSurface& surface, std::vector<bool>& touched)
      : surface_(surface), touched_(touched), is_corner_(surface.points.size()) {
    for (Index i = 0; i < surface.triangles.size(); ++i)
      if (is_flat(i)) stack_.push_back(i);
    if (stack_.empty()) return;
    patience_ = 16 * stack_.size();
    for (const Index i : stack_)
      for (const Index corner : surface.triangles[i]) is_corner_[corner] = true;
    for (Index i = 0; i < surface.triangles.size(); ++i) list_edges(i);
  }

  void run() {
    while (!stack_.empty()) {
      const Index at = stack_.back();
      stack_.pop_back();
      if (is_there(at) && is_flat(at)) replace(at);
    }
    remove_gone(surface_);
  }

 private:
  SingleSurface& surface_;
  std::vector<bool>& touched_;
  std::vector<bool> is_corner_;  // of a triangle without area: edges between such points are listed, or all
  std::vector<Index> stack_;
  std::size_t patience_ = 1;  // with triangles that are not exactly flat
  std::unordered_map<std::uint64_t, std::vector<Index>>
      triangles_at_;  // directed edges; some triangles may have been replaced since

  [[nodiscard]] bool is_there(Index i) const { return surface_.triangles[i][0] != none; }
  [[nodiscard]] bool is_flat(Index i) const {
    const auto& [a, b, c] = surface_.triangles[i];
    return flatness_of(surface_.points[a], surface_.points[b], surface_.points[c]) >
           (patience_ > 0 ? Flatness::no : Flatness::apparent);
  }
  static std::uint64_t name_of(Index from, Index to) { return std::uint64_t{from} << 32 | to; }

  void list_edges(Index i) {
    const Triangle& t = surface_.triangles[i];
    for (std::size_t k = 0; k < 3; ++k)
      if (is_corner_[t[k]] && is_corner_[t[(k + 1) % 3]])
        triangles_at_[name_of(t[k], t[(k + 1) % 3])].push_back(i);
  }

  void list_all_edges() {
    std::fill(is_corner_.begin(), is_corner_.end(), true);
    triangles_at_.clear();
    for (Index i = 0; i < surface_.triangles.size(); ++i)
      if (is_there(i)) list_edges(i);
  }

  /// The triangle turned so that the corner between the others is the second one.
  [[nodiscard]] Triangle turned(Index i) const {
    const Triangle& t = surface_.triangles[i];
    const std::size_t m = middle_of({&surface_.points[t[0]], &surface_.points[t[1]], &surface_.points[t[2]]});
    return {t[(m + 2) % 3], t[m], t[(m + 1) % 3]};
  }

  /// A triangle on the left of this edge, of this part if there is one, and its third corner.
  [[nodiscard]] std::pair<Index, Index> triangle_at(Index from, Index to, std::int32_t owner) {
    // What became flat on the way may have an edge that has not been looked for before.
    if (!is_corner_[from] || !is_corner_[to]) list_all_edges();
    std::pair<Index, Index> first{none, none};
    const auto listed = triangles_at_.find(name_of(from, to));
    if (listed == triangles_at_.end()) return first;
    for (const Index i : listed->second)
      for (std::size_t k = 0; k < 3; ++k) {
        const Triangle& t = surface_.triangles[i];
        if (!is_there(i) || t[k] != from || t[(k + 1) % 3] != to) continue;
        if (surface_.owner[i] == owner) return {i, t[(k + 2) % 3]};
        if (first.first == none) first = {i, t[(k + 2) % 3]};
      }
    return first;
  }

  void replace(Index at) {
    const auto [a, b, c] = turned(at);
    const auto [neighbour, d] = triangle_at(a, c, surface_.owner[at]);
    if (neighbour != none && is_flat(neighbour) && turned(neighbour)[1] != d) {
      if (patience_ > 0)
        --patience_;  // of exactly flat ones each has a longer side than the one before; of others there may
                      // be a ring
      stack_.push_back(at);
      stack_.push_back(neighbour);
      return;
    }
    if (neighbour == none || d == b) {  // the surface ends here, or the two are one and its opposite
      surface_.triangles[at][0] = none;
      if (neighbour != none) surface_.triangles[neighbour][0] = none;
      return;
    }
    if (patience_ > 0) --patience_;
    surface_.triangles[at] = {a, b, d};
    surface_.triangles[neighbour] = {b, c, d};
    surface_.owner[at] = surface_.owner[neighbour];
    for (const Index i : {at, neighbour}) {
      list_edges(i);
      if (is_flat(i)) stack_.push_back(i);
    }
    for (const Index corner : {a, b, c, d}) touched_[corner] = true;
  }
};

/// Removes pairs of triangles with the same corners and opposite sides. @param touched points at which there
/// may be some.
void remove_opposites(SingleSurface& surface, const std::vector<bool>& touched) {
  struct Named {
    Triangle corners;  // ascending
    bool is_turned;
    Index triangle;
    bool operator<(const Named& other) const {
      return std::tie(corners, triangle) < std::tie(other.corners, other.triangle);
    }
  };
  std::vector<Named> named;
  for (Index i = 0; i < surface.triangles.size(); ++i) {
    const Triangle& t = surface.triangles[i];
    if (std::none_of(t.begin(), t.end(), [&](Index corner) { return touched[corner]; })) continue;
    const auto first = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
    const Index second = t[(first + 1) % 3], third = t[(first + 2) % 3];
    named.push_back({{t[first], std::min(second, third), std::max(second, third)}, second > third, i});
  }
  std::sort(named.begin(), named.end());
  bool is_changed = false;
  std::array<std::vector<Index>, 2> of_side;
  for (auto at = named.begin(); at != named.end();) {
    for (auto& triangles : of_side) triangles.clear();
    for (const Triangle corners = at->corners; at != named.end() && at->corners == corners; ++at)
      of_side[at->is_turned].push_back(at->triangle);
    for (std::size_t i = 0; i < std::min(of_side[0].size(), of_side[1].size()); ++i) {
      surface.triangles[of_side[0][i]][0] = surface.triangles[of_side[1][i]][0] = none;
      is_changed = true;
    }
  }
  if (is_changed) remove_gone(surface);
}

/// Of each point the connected part that it belongs to, named by one of its points.
std::vector<Index> parts_of(const TriangleSurface& surface) {
  std::vector<Index> parent(surface.points.size());
  std::iota(parent.begin(), parent.end(), Index{0});
  const auto root = [&](Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Triangle& t : surface.triangles)
    for (const std::size_t k : {1, 2}) {
      const Index a = root(t[0]), b = root(t[k]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  for (Index i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return parent;
}

/// Each part with points of its own, where each is closed by itself.
TriangleSurface separated(const TriangleSurface& surface) {
  std::vector<Index> order(surface.triangles.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::stable_sort(order, {}, [&](Index i) { return surface.owner[i]; });
  TriangleSurface result;
  result.triangles.reserve(order.size());
  std::vector<Index> number(surface.points.size());
  std::vector<std::int32_t> used_by(surface.points.size());
  std::vector<bool> is_used(surface.points.size());
  for (const Index i : order) {
    Triangle t = surface.triangles[i];
    for (Index& corner : t) {
      if (!is_used[corner] || used_by[corner] != surface.owner[i]) {
        is_used[corner] = true;
        used_by[corner] = surface.owner[i];
        number[corner] = static_cast<Index>(result.points.size());
        result.points.push_back(surface.points[corner]);
      }
      corner = number[corner];
    }
    result.triangles.push_back(t);
    result.owner.push_back(surface.owner[i]);
  }
  return result;
}

/// What rounding does to a connected part.
struct PartLoss {
  Point lower{}, upper{};
  double volume = 0, rounded_volume = 0, moved = 0;

  /// In hundred-thousandths: of its volume, or of its size.
  [[nodiscard]] double change() const {
    const double size = std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]});
    const auto share = [](double part, double whole) { return part == 0 ? 0 : part / std::fabs(whole); };
    return 1e5 * std::max(share(moved, size), share(std::fabs(rounded_volume - volume), volume));
  }
};

}  // namespace

SingleSurface rounded_to_single(const TriangleSurface& surface) {
  SingleSurface result;
  std::vector<Index> number(surface.points.size());
  std::vector<bool> touched;  // points that were several
  {
    Welder welder(surface.points.size());
    for (std::size_t i = 0; i < number.size(); ++i) {
      const std::size_t before = result.points.size();
      number[i] = welder.add(single(surface.points[i]), result.points);
      touched.resize(result.points.size());
      if (result.points.size() == before) touched[number[i]] = true;
    }
  }
  result.triangles.reserve(surface.triangles.size());
  result.owner.reserve(surface.triangles.size());
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const Triangle& t = surface.triangles[i];
    const Triangle welded{number[t[0]], number[t[1]], number[t[2]]};
    if (welded[0] == welded[1] || welded[1] == welded[2] || welded[2] == welded[0]) continue;
    result.triangles.push_back(welded);
    result.owner.push_back(surface.owner[i]);
  }
  FlatRemover(result, touched).run();
  remove_opposites(result, touched);
  return result;
}

SingleLoss loss_in_single(const TriangleSurface& surface) {
  if (surface.closes_parts) return loss_in_single(separated(surface));
  const std::vector<Index> part_of = parts_of(surface);
  std::unordered_map<Index, PartLoss> parts;
  Index last = none;
  PartLoss* last_part = nullptr;
  for (const Triangle& t : surface.triangles) {
    const Index name = part_of[t[0]];
    bool is_new = false;
    if (name != last) {  // neighbours are mostly of one
      const auto found = parts.try_emplace(name);
      last = name;
      last_part = &found.first->second;
      is_new = found.second;
    }
    PartLoss& part = *last_part;
    const Point& origin = surface.points[name];  // within the part: what is far away is measured as exactly
    if (is_new) part.lower = part.upper = origin;
    const Point rounded_origin = wide(single(origin));
    std::array<Point, 3> rounded;
    for (std::size_t i = 0; i < 3; ++i) {
      const Point& corner = surface.points[t[i]];
      rounded[i] = wide(single(corner));
      for (std::size_t k = 0; k < 3; ++k) {
        part.lower[k] = std::min(part.lower[k], corner[k]);
        part.upper[k] = std::max(part.upper[k], corner[k]);
        part.moved = std::max(part.moved, std::fabs(rounded[i][k] - corner[k]));
      }
    }
    part.volume += determinant(origin, surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]) / 6;
    part.rounded_volume += determinant(rounded_origin, rounded[0], rounded[1], rounded[2]) / 6;
  }
  SingleLoss loss;
  loss.parts = parts.size();
  const PartLoss* worst = nullptr;
  for (Index i = 0; i < part_of.size();
       ++i) {  // in the order of the points, so that the same one is told whoever hashes
    const auto found = part_of[i] == i ? parts.find(i) : parts.end();
    if (found == parts.end() || !(found->second.change() > 1)) continue;
    ++loss.changed;
    if (worst == nullptr || found->second.change() > worst->change()) worst = &found->second;
  }
  if (worst == nullptr) return loss;
  loss.lower = worst->lower;
  loss.upper = worst->upper;
  loss.volume = worst->volume;
  loss.rounded_volume = worst->rounded_volume;
  loss.moved = worst->moved;
  return loss;
}

}  // namespace bsp2::io
