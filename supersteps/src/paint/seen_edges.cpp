#include "paint/seen_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::supersteps {
namespace {

/// How far beside an edge one looks for what is seen there, and how far apart the two places are whose depths
/// are compared: as far as samples of a picture; pixels.
constexpr double beside = 0.001, apart = 1.0 / 3;
constexpr double shortest = 0.1;  // piece of a line, pixels

Point2 between(const Point2& a, const Point2& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
}

Point2 moved(const Point2& p, const Point2& way, double by) {
  return {p[0] + by * way[0], p[1] + by * way[1]};
}

/// A piece of an edge: shares of its length.
struct Interval {
  double first = 0, last = 1;
  [[nodiscard]] bool is_empty() const { return !(first < last); }
};

/// A box of the picture.
struct Rectangle {
  Point2 low, high;
  explicit Rectangle(std::span<const Point2> points) : low(points[0]), high(points[0]) {
    for (const Point2& p : points)
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
  }
};

/// Numbers of polygons, by squares of the picture.
class Squares {
 public:
  Squares(int width, int height, std::size_t polygons)
      : size_(std::max(2.0, std::sqrt(double{1} * width * height / static_cast<double>(polygons + 1)))),
        columns_(1 + static_cast<int>(width / size_)),
        rows_(1 + static_cast<int>(height / size_)),
        squares_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

  template <typename Use>
  void for_each(const Rectangle& box, const Use& use) {
    const auto at = [&](double place, int count) {
      return static_cast<int>(std::clamp(place / size_, 0.0, count - 1.0));
    };
    for (int y = at(box.low[1], rows_); y <= at(box.high[1], rows_); ++y)
      for (int x = at(box.low[0], columns_); x <= at(box.high[0], columns_); ++x)
        use(squares_[static_cast<std::size_t>(y * columns_ + x)]);
  }

 private:
  double size_;
  int columns_, rows_;
  std::vector<std::vector<std::uint32_t>> squares_;
};

/// Finds the pieces of edges that are lines.
class EdgeFinder {
 public:
  EdgeFinder(const Polygons& all, const Lighting& lighting, int width, int height)
      : all_(all), lighting_(lighting), squares_(width, height, all.ends.size()), asked_(all.ends.size()) {
    for (std::uint32_t i = 0; i < all.ends.size(); ++i) {
      const std::uint32_t first = i == 0 ? 0 : all.ends[i - 1];
      polygons_.emplace_back(reinterpret_cast<const Point2*>(all.points.data()) + first, all.ends[i] - first);
      if (is_opaque(i))
        squares_.for_each(Rectangle(polygons_[i]),
                          [&](std::vector<std::uint32_t>& square) { square.push_back(i); });
    }
  }

  /// @return ends of the pieces, two by two.
  std::vector<Point2> run() {
    for (std::uint32_t i = 0; i < polygons_.size(); ++i) {
      const std::span<const Point2> polygon = polygons_[i];
      const double area = area_of(polygon);
      if (!is_opaque(i) || area == 0) continue;
      geometry::Interruption::check();
      for (std::size_t k = 0; k < polygon.size(); ++k)
        look_along(i, polygon[k], polygon[(k + 1) % polygon.size()], area > 0 ? 1 : -1);
    }
    return std::move(found_);
  }

 private:
  const Polygons& all_;
  const Lighting& lighting_;
  std::vector<std::span<const Point2>> polygons_;
  Squares squares_;
  std::vector<std::uint32_t> asked_, near_;  // for which edge each polygon was asked last; those near one
  std::uint32_t edge_ = 0;
  std::vector<Interval> covered_;
  std::vector<std::pair<double, std::int64_t>> changes_;  // where what lies beyond begins (~number: ends)
  std::multiset<std::uint32_t> beyond_;
  std::vector<Point2> found_;

  [[nodiscard]] bool is_opaque(std::uint32_t polygon) const {
    return all_.inks[5 * std::size_t{polygon} + 3] >= 1;
  }

  static double area_of(std::span<const Point2> polygon) {
    double area = 0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Point2 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
      area +=
          (p[0] - polygon[0][0]) * (q[1] - polygon[0][1]) - (q[0] - polygon[0][0]) * (p[1] - polygon[0][1]);
    }
    return area;
  }

  /// What of a line is in a convex polygon.
  [[nodiscard]] Interval within(std::uint32_t number, const Point2& a, const Point2& b) const {
    const std::span<const Point2> polygon = polygons_[number];
    const double sign = area_of(polygon) > 0 ? 1 : -1;
    Interval inside;
    for (std::size_t k = 0; k < polygon.size() && !inside.is_empty(); ++k) {
      const Point2 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
      const auto side = [&](const Point2& x) {
        return sign * ((q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0]));
      };
      const double at_a = side(a), at_b = side(b);
      if (at_a < 0 && at_b < 0) return {1, 0};
      if (at_a < 0) inside.first = std::max(inside.first, at_a / (at_a - at_b));
      if (at_b < 0) inside.last = std::min(inside.last, at_a / (at_a - at_b));
    }
    return inside;
  }

  void look_along(std::uint32_t number, const Point2& a, const Point2& b, double turn) {
    const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
    if (!(length > 0)) return;
    const Point2 inwards{-turn * (b[1] - a[1]) / length, turn * (b[0] - a[0]) / length};
    find_near(a, b);
    covered_.clear();
    for (const std::uint32_t other : near_)
      if (other > number)
        if (const Interval hidden = within(other, moved(a, inwards, beside), moved(b, inwards, beside));
            !hidden.is_empty())
          covered_.push_back(hidden);
    std::sort(covered_.begin(), covered_.end(),
              [](const Interval& c, const Interval& d) { return c.first < d.first; });
    double reached = 0;
    for (const Interval& hidden : covered_) {
      if ((hidden.first - reached) * length > shortest)
        look_beyond(number, a, b, inwards, {reached, hidden.first});
      reached = std::max(reached, hidden.last);
    }
    if ((1 - reached) * length > std::min(shortest, length / 2))
      look_beyond(number, a, b, inwards, {reached, 1});
  }

  void find_near(const Point2& a, const Point2& b) {
    near_.clear();
    ++edge_;
    Rectangle box(std::array{a, b});
    box.low = moved(box.low, {1, 1}, -beside);
    box.high = moved(box.high, {1, 1}, beside);
    squares_.for_each(box, [&](const std::vector<std::uint32_t>& square) {
      for (const std::uint32_t other : square)
        if (std::exchange(asked_[other], edge_) != edge_) near_.push_back(other);
    });
  }

  /// Adds those pieces of what is seen of an edge beyond which something else is seen.
  void look_beyond(std::uint32_t number, const Point2& a, const Point2& b, const Point2& inwards,
                   const Interval& seen) {
    changes_.clear();
    beyond_.clear();
    for (const std::uint32_t other : near_) {
      if (other == number) continue;
      const Interval part = within(other, moved(a, inwards, -beside), moved(b, inwards, -beside));
      const double first = std::max(part.first, seen.first), last = std::min(part.last, seen.last);
      if (!(first < last)) continue;
      changes_.emplace_back(first, other);
      changes_.emplace_back(last, ~std::int64_t{other});
    }
    std::sort(changes_.begin(), changes_.end());
    double from = seen.first;
    std::optional<double> line;  // where one begins that goes on
    const auto up_to = [&](double to) {
      if (!(from < to)) return;
      const bool is_line = is_edge(number, between(a, b, (from + to) / 2), inwards);
      if (is_line && !line) line = from;
      if (!is_line && line) add(between(a, b, *std::exchange(line, std::nullopt)), between(a, b, from));
      from = to;
    };
    for (const auto& [place, change] : changes_) {
      up_to(place);
      if (change >= 0)
        beyond_.insert(static_cast<std::uint32_t>(change));
      else
        beyond_.erase(beyond_.find(static_cast<std::uint32_t>(~change)));
    }
    up_to(seen.last);
    if (line) add(between(a, b, *line), between(a, b, seen.last));
  }

  [[nodiscard]] bool is_edge(std::uint32_t number, const Point2& place, const Point2& inwards) const {
    if (beyond_.empty()) return true;
    const std::uint32_t nearest = *beyond_.rbegin();
    return nearest < number && lighting_.is_edge(&all_.facets[number], moved(place, inwards, apart / 2),
                                                 &all_.facets[nearest], moved(place, inwards, -apart / 2));
  }

  void add(const Point2& from, const Point2& to) {
    if (std::hypot(to[0] - from[0], to[1] - from[1]) > shortest) found_.insert(found_.end(), {from, to});
  }
};

/// Puts pieces that follow each other together.
class Chains {
 public:
  explicit Chains(std::span<const Point2> pieces) : pieces_(pieces), is_used_(pieces.size() / 2) {
    for (std::size_t end = 0; end < pieces.size(); ++end) ends_[node_of(pieces[end])].push_back(end);
  }

  void write(Polygons& all) {
    for (std::size_t piece = 0; piece < is_used_.size(); ++piece) {
      if (is_used_[piece]) continue;
      is_used_[piece] = true;
      line_ = {pieces_[2 * piece + 1], pieces_[2 * piece]};
      follow();
      std::reverse(line_.begin(), line_.end());
      follow();
      for (const Point2& p : line_) all.line_points.insert(all.line_points.end(), p.begin(), p.end());
      all.line_ends.push_back(static_cast<std::uint32_t>(all.line_points.size() / 2));
    }
  }

 private:
  std::span<const Point2> pieces_;
  std::vector<bool> is_used_;
  std::unordered_map<std::int64_t, std::vector<std::size_t>> ends_;  // of pieces, by where they are
  std::vector<Point2> line_;

  static std::int64_t node_of(const Point2& p) {
    constexpr double grid = 4;  // nodes a pixel
    const auto x = static_cast<std::int64_t>(std::lround(grid * p[0])),
               y = static_cast<std::int64_t>(std::lround(grid * p[1]));
    return x * (std::int64_t{1} << 32) + y;
  }

  /// On from the last point, as straight as it goes.
  void follow() {
    for (;;) {
      const Point2 before = line_[line_.size() - 2], at = line_.back();
      std::optional<std::size_t> best;
      double straightest = 0.5;  // cosine
      for (const std::size_t end : ends_[node_of(at)]) {
        if (is_used_[end / 2]) continue;
        const double cosine = straightness(before, at, pieces_[end ^ 1]);
        if (!(cosine > straightest)) continue;
        straightest = cosine;
        best = end;
      }
      if (!best) return;
      is_used_[*best / 2] = true;
      constexpr double straight = 1 - 1e-7;
      if (straightest > straight) line_.pop_back();
      line_.push_back(pieces_[*best ^ 1]);
    }
  }

  static double straightness(const Point2& a, const Point2& b, const Point2& c) {
    const double u = b[0] - a[0], v = b[1] - a[1], s = c[0] - b[0], t = c[1] - b[1];
    return (u * s + v * t) / (std::hypot(u, v) * std::hypot(s, t));
  }
};

}  // namespace

void add_seen_edges(Polygons& all, const Lighting& lighting, int width, int height) {
  const std::vector<Point2> pieces = EdgeFinder(all, lighting, width, height).run();
  Chains(pieces).write(all);
}

}  // namespace bsp2::supersteps
