#include "lines/joining.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

namespace bsp2::drawing {
namespace {

/// Lines nearer than that are one on a sheet.
constexpr double same_place = finest / 5;

double length_of(const Piece& piece) {
  return std::hypot(piece.to[0] - piece.from[0], piece.to[1] - piece.from[1]);
}

Point2 at(const Piece& piece, double s) {
  if (s <= 0) return piece.from;
  if (s >= 1) return piece.to;
  return {piece.from[0] + s * (piece.to[0] - piece.from[0]),
          piece.from[1] + s * (piece.to[1] - piece.from[1])};
}

/// What has been drawn, by squares of the sheet.
class DrawnLines {
 public:
  explicit DrawnLines(const std::vector<Piece>& all) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Point2 low{infinity, infinity}, high{-infinity, -infinity};
    for (const Piece& piece : all)
      for (const Point2& p : {piece.from, piece.to})
        for (const int k : {0, 1}) {
          low[k] = std::min(low[k], p[k]);
          high[k] = std::max(high[k], p[k]);
        }
    if (all.empty()) low = high = {0, 0};
    origin_ = low;
    const double width = high[0] - low[0], height = high[1] - low[1];
    size_ = std::max({0.25, std::sqrt(width * height / static_cast<double>(all.size() + 1)),
                      std::max(width, height) / 2000});
    columns_ = 1 + static_cast<std::size_t>(width / size_);
    rows_ = 1 + static_cast<std::size_t>(height / size_);
    squares_.resize(columns_ * rows_);
  }

  /// What of a piece is not drawn yet. @return intervals of it, in their order.
  const std::vector<std::array<double, 2>>& left_of(const Piece& piece) {
    taken_.clear();
    const double length = length_of(piece);
    for_each_square(piece, [&](const std::vector<std::uint32_t>& square) {
      for (const std::uint32_t i : square) take(piece, length, pieces_[i]);
    });
    std::sort(taken_.begin(), taken_.end());
    left_.clear();
    double reached = 0;
    for (const auto& [first, last] : taken_) {
      if ((first - reached) * length > same_place) left_.push_back({reached, first});
      reached = std::max(reached, last);
    }
    if ((1 - reached) * length > (taken_.empty() ? 0 : same_place)) left_.push_back({reached, 1});
    return left_;
  }

  void add(const Piece& piece) {
    const auto number = static_cast<std::uint32_t>(pieces_.size());
    pieces_.push_back(piece);
    for_each_square(piece, [&](std::vector<std::uint32_t>& square) { square.push_back(number); });
  }

  [[nodiscard]] std::vector<Piece> take_all() { return std::move(pieces_); }

 private:
  Point2 origin_{};
  double size_ = 1;
  std::size_t columns_ = 1, rows_ = 1;
  std::vector<std::vector<std::uint32_t>> squares_;
  std::vector<Piece> pieces_;
  std::vector<std::array<double, 2>> taken_, left_;

  /// The part of a piece that another one covers: where both are in one place at both ends of it.
  void take(const Piece& piece, double length, const Piece& other) {
    const Point2 along{(piece.to[0] - piece.from[0]) / length, (piece.to[1] - piece.from[1]) / length};
    std::array<double, 2> s{}, aside{};
    for (const int end : {0, 1}) {
      const Point2& p = end == 0 ? other.from : other.to;
      const double dx = p[0] - piece.from[0], dy = p[1] - piece.from[1];
      s[end] = (dx * along[0] + dy * along[1]) / length;
      aside[end] = dy * along[0] - dx * along[1];
    }
    const double first = std::max(0.0, std::min(s[0], s[1])), last = std::min(1.0, std::max(s[0], s[1]));
    if (!((last - first) * length > same_place / 10)) return;
    const double slope = (aside[1] - aside[0]) / (s[1] - s[0]);
    for (const double end : {first, last})
      if (std::fabs(aside[0] + slope * (end - s[0])) > same_place) return;
    taken_.push_back({first, last});
  }

  template <typename Work>
  void for_each_square(const Piece& piece, const Work& work) {
    const auto index = [&](double x, int k, std::size_t count) {
      const double place = (x - origin_[k]) / size_;
      return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(count) - 1));
    };
    const auto [low, high] = std::minmax(piece.from[1], piece.to[1]);
    const std::size_t first_row = index(low - same_place, 1, rows_),
                      last_row = index(high + same_place, 1, rows_);
    for (std::size_t row = first_row; row <= last_row; ++row) {
      double left = std::min(piece.from[0], piece.to[0]), right = std::max(piece.from[0], piece.to[0]);
      if (first_row != last_row && high > low) {
        const double slope = (piece.to[0] - piece.from[0]) / (piece.to[1] - piece.from[1]);
        const double bottom = origin_[1] + static_cast<double>(row) * size_ - same_place;
        const double one = piece.from[0] + slope * (bottom - piece.from[1]),
                     other = piece.from[0] + slope * (bottom + size_ + 2 * same_place - piece.from[1]);
        left = std::max(left, std::min(one, other));
        right = std::min(right, std::max(one, other));
      }
      const std::size_t first = index(left - same_place, 0, columns_),
                        last = index(right + same_place, 0, columns_);
      for (std::size_t column = first; column <= last; ++column) work(squares_[row * columns_ + column]);
    }
  }
};

/// Each line once.
std::vector<Piece> drawn_once(std::vector<Piece> pieces) {
  for (Piece& piece : pieces)
    if (piece.to < piece.from) std::swap(piece.from, piece.to);
  std::erase_if(pieces, [](const Piece& piece) { return piece.from == piece.to; });
  // The strongest first, and the longest of these.
  std::vector<std::tuple<LineKind, double, Point2, Point2>> order;
  order.reserve(pieces.size());
  for (const Piece& piece : pieces) order.emplace_back(piece.kind, -length_of(piece), piece.from, piece.to);
  std::sort(order.begin(), order.end());
  DrawnLines drawn(pieces);
  for (const auto& [kind, length, from, to] : order) {
    const Piece piece{from, to, kind};
    for (const auto& [first, last] : drawn.left_of(piece))
      drawn.add({at(piece, first), at(piece, last), kind});
  }
  return drawn.take_all();
}

/// One of the two ends of a piece.
struct End {
  Point2 place;
  LineKind kind;
  std::uint32_t end;  ///< 2 * piece, and 1 where it is `to`
};
constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();

/// Which pieces follow each other.
class Chains {
 public:
  explicit Chains(const std::vector<Piece>& pieces) : pieces_(pieces), next_(2 * pieces.size(), nothing) {
    std::vector<End> ends;
    for (std::uint32_t i = 0; i < pieces.size(); ++i) {
      ends.push_back({pieces[i].from, pieces[i].kind, 2 * i});
      ends.push_back({pieces[i].to, pieces[i].kind, 2 * i + 1});
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
      return std::tie(a.kind, a.place, a.end) < std::tie(b.kind, b.place, b.end);
    });
    for (std::size_t first = 0, last = 0; first < ends.size(); first = last) {
      while (last < ends.size() && ends[last].kind == ends[first].kind &&
             ends[last].place == ends[first].place)
        ++last;
      pair(std::span(ends).subspan(first, last - first));
    }
  }

  [[nodiscard]] std::vector<Stroke> strokes() const {
    std::vector<Stroke> all;
    std::vector<bool> is_used(pieces_.size());
    for (const bool closed : {false, true})
      for (std::uint32_t i = 0; i < pieces_.size(); ++i)
        for (const std::uint32_t end : {2 * i, 2 * i + 1})
          if (!is_used[i] && (closed || next_[end] == nothing)) all.push_back(follow(end, is_used));
    return all;
  }

 private:
  const std::vector<Piece>& pieces_;
  std::vector<std::uint32_t> next_;  // the end that follows another one, in the same place

  [[nodiscard]] Point2 place(std::uint32_t end) const {
    return end % 2 == 0 ? pieces_[end / 2].from : pieces_[end / 2].to;
  }
  /// Of the piece, from its end.
  [[nodiscard]] double direction(std::uint32_t end) const {
    const Point2 from = place(end), to = place(end ^ 1U);
    return std::atan2(to[1] - from[1], to[0] - from[0]);
  }

  /// Dashes end at corners, if there is room for any; what is solid need not.
  [[nodiscard]] bool may_turn(std::uint32_t end) const {
    constexpr double dash = 3;  // millimetres
    return pieces_[end / 2].kind != LineKind::hidden || length_of(pieces_[end / 2]) < dash;
  }

  /// At one place: those that go on most straight follow each other.
  void pair(std::span<const End> ends) {
    constexpr double small_bend = 0.6;  // radians
    constexpr std::size_t many = 16;
    if (ends.size() < 2 || ends.size() > many) return;
    std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> pairs;
    for (std::size_t i = 0; i < ends.size(); ++i)
      for (std::size_t k = i + 1; k < ends.size(); ++k) {
        const double bend = std::fabs(std::remainder(
            direction(ends[i].end) - direction(ends[k].end) + std::numbers::pi, 2 * std::numbers::pi));
        if (bend < small_bend || (may_turn(ends[i].end) && may_turn(ends[k].end)))
          pairs.emplace_back(bend, ends[i].end, ends[k].end);
      }
    std::sort(pairs.begin(), pairs.end());
    for (const auto& [bend, one, other] : pairs) {
      if (next_[one] != nothing || next_[other] != nothing) continue;
      next_[one] = other;
      next_[other] = one;
    }
  }

  [[nodiscard]] Stroke follow(std::uint32_t start, std::vector<bool>& is_used) const {
    Stroke stroke;
    stroke.kind = pieces_[start / 2].kind;
    stroke.points.push_back(place(start));
    for (std::uint32_t end = start; end != nothing && !is_used[end / 2]; end = next_[end ^ 1U]) {
      is_used[end / 2] = true;
      add(stroke.points, place(end ^ 1U));
    }
    if (stroke.points.size() > 3 && stroke.points.front() == stroke.points.back()) {
      stroke.points.pop_back();
      stroke.is_closed = true;
    }
    return stroke;
  }

  /// Without the last point where the line goes straight on through it.
  static void add(std::vector<Point2>& points, const Point2& next) {
    constexpr double straight = 1e-6;
    if (points.size() > 1) {
      const Point2 &p = points[points.size() - 2], &q = points.back();
      const double ax = q[0] - p[0], ay = q[1] - p[1], bx = next[0] - q[0], by = next[1] - q[1];
      if (std::fabs(ax * by - ay * bx) <= straight * std::hypot(ax, ay) * std::hypot(bx, by))
        points.pop_back();
    }
    points.push_back(next);
  }
};

double distance_from(const Point2& p, const Point2& a, const Point2& b) {
  const double dx = b[0] - a[0], dy = b[1] - a[1], squared = dx * dx + dy * dy;
  const double s =
      squared > 0 ? std::clamp(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / squared, 0.0, 1.0) : 0;
  return std::hypot(p[0] - a[0] - s * dx, p[1] - a[1] - s * dy);
}

/// Leaves out points without which a line is where it was, as far as a sheet shows. @return whether anything
/// is left to be seen. Source: Douglas, Peucker, "Algorithms for the reduction of the number of points
/// required to represent a digitized line" (1973).
bool thin_out(Stroke& stroke) {
  std::vector<Point2>& points = stroke.points;
  if (stroke.is_closed) points.push_back(points.front());
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    length += std::hypot(points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]);
  if (length < finest) return false;
  std::vector<bool> stays(points.size());
  stays.front() = stays.back() = true;
  std::vector<std::array<std::size_t, 2>> spans{{0, points.size() - 1}};
  while (!spans.empty()) {
    const auto [first, last] = spans.back();
    spans.pop_back();
    std::size_t farthest = first;
    double most = finest / 2;
    for (std::size_t i = first + 1; i < last; ++i)
      if (const double aside = distance_from(points[i], points[first], points[last]); aside > most)
        most = aside, farthest = i;
    if (farthest == first) continue;
    stays[farthest] = true;
    spans.push_back({first, farthest});
    spans.push_back({farthest, last});
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (stays[i]) points[count++] = points[i];
  points.resize(count);
  if (stroke.is_closed && points.size() > 3)
    points.pop_back();
  else
    stroke.is_closed = false;
  return true;
}

}  // namespace

std::vector<Stroke> joined(std::vector<Piece> pieces, std::uint64_t& dropped) {
  const std::vector<Piece> once = drawn_once(std::move(pieces));
  std::vector<Stroke> strokes = Chains(once).strokes();
  dropped += std::erase_if(strokes, [](Stroke& stroke) { return !thin_out(stroke); });
  return strokes;
}

}  // namespace bsp2::drawing
