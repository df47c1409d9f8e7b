#include "bsp2/drawing/lines/hidden_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "bsp2/geometry/support/parallel.hpp"

// Notation: a point is seen at (u, v), with w towards who looks; all integers. A triangle that is in front of
// an edge covers an interval of it: where the edge is seen inside of the triangle, and behind its plane.
// Along the edge a place is told by s in [0, 1]. Which case it is, is decided exactly; where an interval ends
// is a quotient of exact numbers, so two triangles with a common side end in one place, bit by bit.

namespace bsp2::drawing {
namespace {

using geometry::Brep;
__extension__ using Wide = __int128;
using Grid = std::int64_t;

struct Seen {
  Grid u, v, w;
};

/// Twice the area of a triangle as it is seen: above 0 if it is counter-clockwise.
Wide turn(const Seen& p, const Seen& q, const Seen& r) {
  return static_cast<Wide>(q.u - p.u) * (r.v - p.v) - static_cast<Wide>(q.v - p.v) * (r.u - p.u);
}

int sign(Wide x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

/// A face, or a triangle, that is turned towards who looks.
struct Cover {
  std::array<std::uint32_t, 3> corners;
  std::uint32_t face;
  Grid nearest;                 ///< its largest w
  Grid left, right, low, high;  ///< of u and v
  double touching;              ///< how far, times the length of the normal, what touches its plane may be
};

/// Part of an edge.
struct Interval {
  double first, last;
};

constexpr double touching_units = 4;

/// All points and triangles as one view has them.
class Scene {
 public:
  Scene(const Brep& brep, const GridPoints& grid, const ViewAxes& axes) : brep_(brep) {
    points_.reserve(grid.points.size());
    for (const auto& p : grid.points)
      points_.push_back({along(axes[0], p), along(axes[1], p), along(axes[2], p)});
    turn_faces();
    collect_covers();
    fill_squares();
  }

  [[nodiscard]] const Seen& point(std::uint32_t i) const { return points_[i]; }
  [[nodiscard]] const std::vector<Cover>& covers() const { return covers_; }
  /// 1: who looks sees its front; -1: its back; 0: it is seen from its edge.
  [[nodiscard]] int facing(std::uint32_t face) const { return facing_[face]; }

  /// Calls `work(cover)` for all triangles that may cover a piece of the edge, for some more than once, until
  /// it returns true.
  template <typename Work>
  void near(const Seen& a, const Seen& b, const Work& work) const {
    if (covers_.empty()) return;
    const Grid farthest = std::min(a.w, b.w);
    const auto [first_row, last_row] = std::minmax({row_of(a.v), row_of(b.v)});
    for (int row = first_row; row <= last_row; ++row) {
      // Where the edge is while it is in the row, and a square more on each side.
      double low = static_cast<double>(std::min(a.u, b.u)), high = static_cast<double>(std::max(a.u, b.u));
      if (first_row != last_row) {
        const double slope = static_cast<double>(b.u - a.u) / static_cast<double>(b.v - a.v);
        const double at_low = static_cast<double>(a.u) + slope * (v_of(row) - static_cast<double>(a.v));
        const double at_high = static_cast<double>(a.u) + slope * (v_of(row + 1) - static_cast<double>(a.v));
        low = std::max(low, std::min(at_low, at_high));
        high = std::min(high, std::max(at_low, at_high));
      }
      const int first = std::max(0, column_of(low) - 1), last = std::min(columns_ - 1, column_of(high) + 1);
      for (int column = first; column <= last; ++column) {
        const auto square = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                            static_cast<std::size_t>(column);
        for (std::uint32_t i = first_of_[square]; i < first_of_[square + 1]; ++i) {
          if (covers_[in_squares_[i]].nearest <= farthest) break;  // nor are the others nearer
          if (work(in_squares_[i])) return;
        }
      }
    }
  }

 private:
  const Brep& brep_;
  std::vector<Seen> points_;
  std::vector<int> facing_;
  std::vector<Cover> covers_;
  Grid u_ = 0, v_ = 0;
  double square_u_ = 1, square_v_ = 1;
  int columns_ = 1, rows_ = 1;
  std::vector<std::uint32_t> first_of_, in_squares_;

  static Grid along(const std::array<Grid, 3>& axis, const std::array<Grid, 3>& p) {
    return axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
  }

  /// A face is as much towards who looks as its triangles are together; less than rounding is not at all.
  void turn_faces() {
    std::vector<Wide> area(brep_.faces.size());
    std::vector<double> reach(brep_.faces.size());
    for (std::size_t i = 0; i < brep_.triangles.size(); ++i) {
      const auto& [a, b, c] = brep_.triangles[i];
      const std::uint32_t face = brep_.face_of_triangle[i];
      area[face] += turn(points_[a], points_[b], points_[c]);
      for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}})
        reach[face] += std::fabs(static_cast<double>(points_[to].u - points_[from].u)) +
                       std::fabs(static_cast<double>(points_[to].v - points_[from].v));
    }
    facing_.resize(brep_.faces.size());
    for (std::size_t face = 0; face < facing_.size(); ++face)
      if (std::fabs(static_cast<double>(area[face])) > touching_units * reach[face])
        facing_[face] = sign(area[face]);
  }

  void collect_covers() {
    for (std::size_t i = 0; i < brep_.triangles.size(); ++i) {
      const std::uint32_t face = brep_.face_of_triangle[i];
      if (brep_.faces[face].other != Brep::outside || facing_[face] <= 0) continue;
      const auto& corners = brep_.triangles[i];
      const Seen &a = points_[corners[0]], &b = points_[corners[1]], &c = points_[corners[2]];
      if (turn(a, b, c) <= 0) continue;  // rounding has turned it: its neighbours cover what it would
      Cover cover{corners,
                  face,
                  std::max({a.w, b.w, c.w}),
                  std::min({a.u, b.u, c.u}),
                  std::max({a.u, b.u, c.u}),
                  std::min({a.v, b.v, c.v}),
                  std::max({a.v, b.v, c.v}),
                  0};
      const auto length = [&](int first, int second) {
        const auto d = [&](const Seen& p, int k) {
          return static_cast<double>(k == 0 ? p.u - a.u : k == 1 ? p.v - a.v : p.w - a.w);
        };
        return d(b, first) * d(c, second) - d(b, second) * d(c, first);
      };
      cover.touching = touching_units * std::hypot(length(1, 2), length(2, 0), length(0, 1));
      covers_.push_back(cover);
    }
    // The nearest first: they hide most.
    std::stable_sort(covers_.begin(), covers_.end(),
                     [](const Cover& a, const Cover& b) { return a.nearest > b.nearest; });
  }

  [[nodiscard]] int column_of(double u) const {
    return static_cast<int>(std::clamp((u - static_cast<double>(u_)) / square_u_, 0.0, columns_ - 1.0));
  }
  [[nodiscard]] int row_of(Grid v) const {
    return static_cast<int>(std::clamp(static_cast<double>(v - v_) / square_v_, 0.0, rows_ - 1.0));
  }
  [[nodiscard]] double v_of(int row) const { return static_cast<double>(v_) + row * square_v_; }

  /// Squares of about as many triangles each, and in each those that may reach into it.
  void fill_squares() {
    if (covers_.empty()) return;
    Seen low = points_[covers_[0].corners[0]], high = low;
    for (const Seen& p : points_) {
      low = {std::min(low.u, p.u), std::min(low.v, p.v), 0};
      high = {std::max(high.u, p.u), std::max(high.v, p.v), 0};
    }
    constexpr double most = 1024;
    u_ = low.u;
    v_ = low.v;
    columns_ = rows_ =
        static_cast<int>(std::clamp(std::sqrt(static_cast<double>(covers_.size())), 1.0, most));
    const auto divide = [&] {
      square_u_ = std::max(1.0, static_cast<double>(high.u - low.u) / columns_);
      square_v_ = std::max(1.0, static_cast<double>(high.v - low.v) / rows_);
      std::size_t entries = 0;
      for_each_square([&](std::size_t, std::uint32_t) { ++entries; });
      return entries;
    };
    // Long triangles reach into many squares: there coarser ones are better.
    while (divide() > 32 * covers_.size() && columns_ > 8) columns_ = rows_ = columns_ / 2;
    const auto squares = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    first_of_.assign(squares + 1, 0);
    for_each_square([&](std::size_t square, std::uint32_t) { ++first_of_[square + 1]; });
    for (std::size_t i = 0; i < squares; ++i) first_of_[i + 1] += first_of_[i];
    in_squares_.resize(first_of_.back());
    std::vector<std::uint32_t> next(first_of_.begin(), first_of_.end() - 1);
    for_each_square([&](std::size_t square, std::uint32_t cover) { in_squares_[next[square]++] = cover; });
  }

  template <typename Work>
  void for_each_square(const Work& work) const {
    for (std::uint32_t i = 0; i < covers_.size(); ++i) {
      const std::array corners{&points_[covers_[i].corners[0]], &points_[covers_[i].corners[1]],
                               &points_[covers_[i].corners[2]]};
      const auto [low, high] = std::minmax({corners[0]->v, corners[1]->v, corners[2]->v});
      const int first_row = row_of(low), last_row = row_of(high);
      for (int row = first_row; row <= last_row; ++row) {
        double left = 1e300, right = -1e300;
        const double bottom = row == first_row ? static_cast<double>(low) : v_of(row),
                     top = row == last_row ? static_cast<double>(high) : v_of(row + 1);
        for (std::size_t side = 0; side < 3; ++side)
          widen(*corners[side], *corners[(side + 1) % 3], bottom, top, left, right);
        const int first = std::max(0, column_of(left) - 1),
                  last = std::min(columns_ - 1, column_of(right) + 1);
        for (int column = first; column <= last; ++column)
          work(static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(column),
               i);
      }
    }
  }

  /// By where a side of a triangle is between two heights.
  static void widen(const Seen& p, const Seen& q, double bottom, double top, double& left, double& right) {
    const double low = static_cast<double>(std::min(p.v, q.v)),
                 high = static_cast<double>(std::max(p.v, q.v));
    if (low > top || high < bottom) return;
    const auto include = [&](double u) {
      left = std::min(left, u);
      right = std::max(right, u);
    };
    if (p.v == q.v) {
      include(static_cast<double>(p.u));
      include(static_cast<double>(q.u));
      return;
    }
    const double slope = static_cast<double>(q.u - p.u) / static_cast<double>(q.v - p.v);
    for (const double v : {std::clamp(bottom, low, high), std::clamp(top, low, high)})
      include(static_cast<double>(p.u) + slope * (v - static_cast<double>(p.v)));
  }
};

/// Joins intervals that touch; `gap` between them does not count.
void unite(std::vector<Interval>& intervals, double gap) {
  std::sort(intervals.begin(), intervals.end(),
            [](const Interval& a, const Interval& b) { return a.first < b.first; });
  std::size_t count = 0;
  for (const Interval& each : intervals) {
    if (count > 0 && each.first <= intervals[count - 1].last + gap)
      intervals[count - 1].last = std::max(intervals[count - 1].last, each.last);
    else
      intervals[count++] = each;
  }
  intervals.resize(count);
}

/// What is in both of two unions.
std::vector<Interval> common(const std::vector<Interval>& a, const std::vector<Interval>& b) {
  std::vector<Interval> both;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const Interval shared{std::max(a[i].first, b[j].first), std::min(a[i].last, b[j].last)};
    if (shared.first < shared.last) both.push_back(shared);
    (a[i].last < b[j].last ? i : j)++;
  }
  return both;
}

/// What covers one edge after the other. One a thread.
class Hider {
 public:
  explicit Hider(const Scene& scene) : scene_(scene), seen_by_(scene.covers().size()) {}

  /// Where the edge is hidden. @param faces in which it lies: these do not hide it.
  const std::vector<Interval>& hidden(const Seen& a, const Seen& b, std::span<const std::uint32_t> faces,
                                      double gap) {
    left_.clear();
    right_.clear();
    ++edge_;
    const auto [left, right] = std::minmax(a.u, b.u);
    const auto [low, high] = std::minmax(a.v, b.v);
    bool is_all = false;
    scene_.near(a, b, [&, left = left, right = right, low = low, high = high](std::uint32_t number) {
      if (std::exchange(seen_by_[number], edge_) == edge_) return false;
      const Cover& cover = scene_.covers()[number];
      if (cover.left > right || cover.right < left || cover.low > high || cover.high < low) return false;
      if (std::find(faces.begin(), faces.end(), cover.face) == faces.end()) is_all = add(a, b, cover);
      return is_all;
    });
    if (is_all) {
      both_.assign(1, {0, 1});
      return both_;
    }
    unite(left_, gap);
    unite(right_, gap);
    both_ = common(left_, right_);
    unite(both_, gap);
    return both_;
  }

 private:
  const Scene& scene_;
  std::vector<std::uint32_t> seen_by_;  // the last edge of each triangle
  std::uint32_t edge_ = 0;
  std::vector<Interval> left_, right_, both_;  // of the edge, as it is seen from its first point to the last

  static double quotient(Wide a, Wide b) { return static_cast<double>(a) / static_cast<double>(b); }

  /// @return whether the triangle covers all of the edge, on both sides.
  bool add(const Seen& a, const Seen& b, const Cover& cover) {
    const std::array corners{&scene_.point(cover.corners[0]), &scene_.point(cover.corners[1]),
                             &scene_.point(cover.corners[2])};
    double first = 0, last = 1;
    bool on_left = true, on_right = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const Seen &p = *corners[i], &q = *corners[(i + 1) % 3];
      const Wide at_a = turn(p, q, a), at_b = turn(p, q, b);
      if (at_a > 0 && at_b > 0) continue;
      if (at_a <= 0 && at_b <= 0) {
        if (at_a != 0 || at_b != 0) return false;
        // Along the side: the triangle is on the left of that.
        const bool same =
            static_cast<Wide>(q.u - p.u) * (b.u - a.u) + static_cast<Wide>(q.v - p.v) * (b.v - a.v) > 0;
        (same ? on_right : on_left) = false;
      } else if (at_a > 0) {
        last = std::min(last, quotient(at_a, at_a - at_b));
      } else {
        first = std::max(first, quotient(at_a, at_a - at_b));
      }
    }
    if (!(first < last) || !cut_in_front(a, b, corners, cover.touching, first, last)) return false;
    if (on_left) left_.push_back({first, last});
    if (on_right) right_.push_back({first, last});
    return on_left && on_right && first == 0 && last == 1;
  }

  /// Leaves of an interval where the edge is behind the plane of a triangle. @return whether anything.
  static bool cut_in_front(const Seen& a, const Seen& b, const std::array<const Seen*, 3>& corners,
                           double touching, double& first, double& last) {
    Wide at_a = behind(corners, a), at_b = behind(corners, b);
    if (std::fabs(static_cast<double>(at_a)) <= touching) at_a = 0;
    if (std::fabs(static_cast<double>(at_b)) <= touching) at_b = 0;
    if (at_a <= 0 && at_b <= 0) return false;
    if (at_a >= 0 && at_b >= 0) return true;
    const double crossing = quotient(at_a, at_a - at_b);
    if (at_a < 0)
      first = std::max(first, crossing);
    else
      last = std::min(last, crossing);
    return first < last;
  }

  /// How far behind a triangle's plane a point is, times the length of its normal.
  static Wide behind(const std::array<const Seen*, 3>& t, const Seen& p) {
    const Seen &o = *t[0], &b = *t[1], &c = *t[2];
    const Wide nu = static_cast<Wide>(b.v - o.v) * (c.w - o.w) - static_cast<Wide>(b.w - o.w) * (c.v - o.v);
    const Wide nv = static_cast<Wide>(b.w - o.w) * (c.u - o.u) - static_cast<Wide>(b.u - o.u) * (c.w - o.w);
    const Wide nw = static_cast<Wide>(b.u - o.u) * (c.v - o.v) - static_cast<Wide>(b.v - o.v) * (c.u - o.u);
    return nu * (o.u - p.u) + nv * (o.v - p.v) + nw * (o.w - p.w);
  }
};

/// An edge that is drawn.
struct Drawn {
  std::uint32_t edge;
  bool is_smooth;
};

bool is_smooth(const Brep& brep, const Brep::Edge& edge, double smooth_angle) {
  if (edge.count != 2) return false;
  const double angle = brep.uses[brep.uses_of_edges[edge.first]].angle;
  return std::fabs(angle - std::numbers::pi) < smooth_angle * std::numbers::pi / 180;
}

std::vector<Drawn> drawn_edges(const Brep& brep, const Scene& scene, const LineOptions& options) {
  std::vector<Drawn> drawn;
  for (std::uint32_t i = 0; i < brep.edges.size(); ++i) {
    const Brep::Edge& edge = brep.edges[i];
    const Seen &a = scene.point(edge.ends[0]), &b = scene.point(edge.ends[1]);
    if (a.u == b.u && a.v == b.v) continue;
    if (!is_smooth(brep, edge, options.smooth_angle)) {
      drawn.push_back({i, false});
      continue;
    }
    const int one = scene.facing(brep.uses[brep.uses_of_edges[edge.first]].face),
              other = scene.facing(brep.uses[brep.uses_of_edges[edge.first + 1]].face);
    if (std::max(one, other) > 0 && std::min(one, other) <= 0)
      drawn.push_back({i, false});
    else if (options.smooth_edges && one > 0 && other > 0)
      drawn.push_back({i, true});
  }
  return drawn;
}

/// Leaves those of a part. Its blocks are short, since edges that are near each other take alike long.
void keep(const EdgePart& part, std::vector<Drawn>& drawn) {
  constexpr std::size_t block = 64;
  std::size_t count = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i)
    if (const std::size_t number = i / block % part.of; number >= part.first && number < part.end)
      drawn[count++] = drawn[i];
  drawn.resize(count);
}

/// Turns places on an edge into pieces.
class Cutter {
 public:
  Cutter(const Brep& brep, const ViewAxes& axes, const LineOptions& options)
      : brep_(brep), axes_(axes), options_(options) {}

  void cut(const Drawn& drawn, const std::vector<Interval>& hidden, std::vector<Piece>& pieces) const {
    const Brep::Edge& edge = brep_.edges[drawn.edge];
    const Point2 a = seen(axes_, brep_.points[edge.ends[0]]), b = seen(axes_, brep_.points[edge.ends[1]]);
    const auto add = [&](double first, double last, LineKind kind) {
      if (first < last) pieces.push_back({between(a, b, first), between(a, b, last), kind});
    };
    const LineKind visible = drawn.is_smooth ? LineKind::visible_smooth : LineKind::visible;
    double at = 0;
    for (const Interval& each : hidden) {
      add(at, each.first, visible);
      if (options_.hidden && !drawn.is_smooth) add(each.first, each.last, LineKind::hidden);
      at = each.last;
    }
    add(at, 1, visible);
  }

 private:
  const Brep& brep_;
  const ViewAxes& axes_;
  const LineOptions& options_;

  static Point2 between(const Point2& a, const Point2& b, double s) {
    if (s == 0) return a;
    if (s == 1) return b;
    return {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])};
  }
};

}  // namespace

std::vector<Piece> lines_of(const Brep& brep, const GridPoints& grid, const ViewAxes& axes,
                            const LineOptions& options) {
  const Scene scene(brep, grid, axes);
  std::vector<Drawn> drawn = drawn_edges(brep, scene, options);
  keep(options.part, drawn);
  const Cutter cutter(brep, axes, options);
  constexpr std::size_t grain = 512;
  std::vector<std::vector<Piece>> pieces((drawn.size() + grain - 1) / grain);
  geometry::for_each_range(drawn.size(), grain, options.threads, [&](std::size_t first, std::size_t end) {
    Hider hider(scene);
    std::vector<std::uint32_t> faces;
    for (std::size_t i = first; i < end; ++i) {
      const Brep::Edge& edge = brep.edges[drawn[i].edge];
      faces.clear();
      for (std::uint32_t use = 0; use < edge.count; ++use)
        faces.push_back(brep.uses[brep.uses_of_edges[edge.first + use]].face);
      const Point2 a = seen(axes, brep.points[edge.ends[0]]), b = seen(axes, brep.points[edge.ends[1]]);
      const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
      const double gap = length > 0 ? std::min(0.5, options.shortest / length) : 0;
      std::vector<Interval> hidden =
          hider.hidden(scene.point(edge.ends[0]), scene.point(edge.ends[1]), faces, gap);
      if (!hidden.empty() && hidden.front().first <= gap) hidden.front().first = 0;
      if (!hidden.empty() && hidden.back().last >= 1 - gap) hidden.back().last = 1;
      cutter.cut(drawn[i], hidden, pieces[first / grain]);
    }
  });
  std::vector<Piece> all;
  for (const auto& some : pieces) all.insert(all.end(), some.begin(), some.end());
  return all;
}

}  // namespace bsp2::drawing
