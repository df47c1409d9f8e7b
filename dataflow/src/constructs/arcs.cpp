#include "constructs/arcs.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>

namespace bsp2::dataflow {
namespace {

using geometry::OutlinePath;
using Point = std::array<double, 2>;
using Beside = CircleSkins::Beside;

constexpr double pi = std::numbers::pi;

double distance(const Point& a, const Point& b) { return std::hypot(b[0] - a[0], b[1] - a[1]); }

/// The angle between two directions, the shorter way.
double between(double from, double to) { return std::remainder(to - from, 2 * pi); }

/// With its arcs: a bulge of b over a chord has the angle 4 atan b.
double area_with_arcs(const OutlinePath& path) {
  double twice = 0;
  const std::size_t n = path.corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Point &p = path.corners[i], &q = path.corners[(i + 1) % n], &o = path.corners[0];
    twice += (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
    const double b = path.bulges.empty() ? 0 : path.bulges[i];
    if (b == 0) continue;
    const double angle = 4 * std::atan(b), radius = distance(p, q) / 2 / std::sin(angle / 2);
    twice += radius * radius * (angle - std::sin(angle));
  }
  return twice / 2;
}

/// Whether a ray to the right crosses a piece of a path an odd number of times.
bool crosses(const Point& from, const Point& to, double bulge, const Point& p) {
  if (bulge == 0)
    return (from[1] > p[1]) != (to[1] > p[1]) &&
           p[0] < from[0] + (p[1] - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
  const geometry::OutlineArc arc(from, to, bulge);
  const double y = p[1] - arc.centre[1];
  if (std::fabs(y) >= arc.radius) return false;
  bool is_odd = false;
  for (const double side : {-1.0, 1.0}) {
    const double x = arc.centre[0] + side * std::sqrt((arc.radius - y) * (arc.radius + y));
    const double beside = (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (x - from[0]);
    is_odd ^= x > p[0] && (beside < 0) == (bulge > 0);
  }
  return is_odd;
}

bool contain(const std::vector<OutlinePath>& paths, const Point& p) {
  bool is_inside = false;
  for (const OutlinePath& path : paths)
    for (std::size_t i = 0; i < path.corners.size(); ++i)
      is_inside ^= crosses(path.corners[i], path.corners[(i + 1) % path.corners.size()],
                           path.bulges.empty() ? 0 : path.bulges[i], p);
  return is_inside;
}

/// A point of a polygon that is on no line to the right of a corner of another one, as good as certainly.
Point some_point(const OutlinePath& polygon) {
  const auto rise = [&](std::size_t i) {
    return std::fabs(polygon.corners[(i + 1) % polygon.corners.size()][1] - polygon.corners[i][1]);
  };
  std::size_t steepest = 0;
  for (std::size_t i = 1; i < polygon.corners.size(); ++i)
    if (rise(i) > rise(steepest)) steepest = i;
  const Point &a = polygon.corners[steepest], &b = polygon.corners[(steepest + 1) % polygon.corners.size()];
  constexpr double share = 0.3819660113;
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])};
}

/// Edges of a path, one after the other, of which the same is known.
struct OutlinePiece {
  enum class Kind : std::uint8_t { line, circle, unsure } kind;
  std::uint32_t number;                  ///< of the line or circle
  std::uint32_t line;                    ///< of its last edge
  std::vector<std::uint32_t> circles{};  ///< that are left beside what is unsure
  std::vector<Point> corners{};          ///< two or more
  /// Where it meets its neighbour, if that is certain: its end is there, and not in its last corner.
  std::optional<Point> start{}, end{};
  bool is_bridged = false;  ///< its neighbours meet: it is left out

  [[nodiscard]] const Point& from() const { return corners.front(); }
  [[nodiscard]] const Point& to() const { return corners.back(); }
  /// What comes next. Corners on a straight line are left out, but for those near circles: they tell the way.
  void append(OutlinePiece&& next) {
    if (kind == Kind::line || (kind == Kind::unsure && line == next.line)) corners.pop_back();
    corners.insert(corners.end(), next.corners.begin() + 1, next.corners.end());
    circles.insert(circles.end(), next.circles.begin(), next.circles.end());
    line = next.line;
  }
};

class ArcFitter {
 public:
  ArcFitter(const Network<2>& network, const CircleSkins& skins, const std::vector<Point>& points,
            std::int32_t part)
      : network_(network), skins_(skins), points_(points), part_(part) {}

  /// A path with arcs.
  OutlinePath fit(const std::vector<TracedEdge>& path) {
    divide(path);
    if (const auto circle = whole_circle()) return *circle;
    join_alike();
    while (pieces_.size() > 1 && !join_all()) unite_unsure();
    return assembled();
  }
  std::uint32_t arcs = 0, polygons = 0;  ///< of the last path
  /// Whether it has neither arcs nor lines.
  [[nodiscard]] bool is_unsure() const {
    return arcs == 0 && std::none_of(pieces_.begin(), pieces_.end(),
                                     [](const OutlinePiece& piece) { return piece.kind == Kind::line; });
  }

 private:
  using Kind = OutlinePiece::Kind;
  const Network<2>& network_;
  const CircleSkins& skins_;
  const std::vector<Point>& points_;
  std::int32_t part_;
  std::vector<OutlinePiece> pieces_;

  // --- pieces ---

  [[nodiscard]] OutlinePiece piece_of(const TracedEdge& edge) const {
    OutlinePiece piece{Kind::line, edge.line, edge.line};
    piece.corners = {points_[edge.from], points_[edge.to]};
    if (edge.beyond == TracedEdge::nothing) {
      if (skins_.is_empty() && skins_.is_of_curve(edge.line)) piece.kind = Kind::unsure;
      return piece;
    }
    const auto circles = skins_.circles_of(edge.beyond);
    piece.kind = circles.size() == 1 ? Kind::circle : Kind::unsure;
    if (circles.size() == 1) piece.number = circles[0];
    if (circles.size() > 1) piece.circles.assign(circles.begin(), circles.end());
    return piece;
  }

  /// Whether they are of one line or circle. Tangents may fall upon lines, under numbers of their own.
  [[nodiscard]] bool are_alike(const OutlinePiece& a, const OutlinePiece& b) const {
    if (a.kind != b.kind) return false;
    if (a.kind != Kind::line || a.number == b.number) return a.kind == Kind::unsure || a.number == b.number;
    const auto g = network_.table.rounded(a.number), h = network_.table.rounded(b.number);
    const double cross = g.normal[0] * h.normal[1] - g.normal[1] * h.normal[0];
    return std::fabs(cross) <= 1e-12 && std::fabs(h.at(a.from())) <= skins_.rounding() &&
           std::fabs(h.at(a.to())) <= skins_.rounding();
  }

  void divide(const std::vector<TracedEdge>& path) {
    pieces_.clear();
    for (const TracedEdge& edge : path) add(piece_of(edge));
    if (pieces_.size() < 2 || !are_alike(pieces_.back(), pieces_.front())) return;
    pieces_.back().append(std::move(pieces_.front()));  // the path began within a piece
    pieces_.erase(pieces_.begin());
  }
  void add(OutlinePiece&& piece) {
    if (!pieces_.empty() && are_alike(pieces_.back(), piece))
      pieces_.back().append(std::move(piece));
    else
      pieces_.push_back(std::move(piece));
  }

  /// By how much the corners of a piece turn to the left around a circle.
  [[nodiscard]] static double sweep_of(const OutlinePiece& piece, const Circle& circle) {
    double sweep = 0;
    for (std::size_t i = 0; i + 1 < piece.corners.size(); ++i)
      sweep += between(circle.angle_of(piece.corners[i]), circle.angle_of(piece.corners[i + 1]));
    return sweep;
  }
  [[nodiscard]] double angle(const OutlinePiece& piece, const Point& point) const {
    return skins_.circle(piece.number).angle_of(point);
  }
  /// The angle at which a piece of a circle begins, as an arc, and how far it turns.
  [[nodiscard]] std::pair<double, double> arc_of(const OutlinePiece& piece) const {
    double from = angle(piece, piece.from()), sweep = sweep_of(piece);
    if (piece.end) sweep += between(angle(piece, piece.to()), angle(piece, *piece.end));
    if (!piece.start) return {from, sweep};
    const double before = between(from, angle(piece, *piece.start));
    return {from + before, sweep - before};
  }

  /// The path, if it goes once around one circle that bounds the solid all around.
  std::optional<OutlinePath> whole_circle() {
    const auto first = std::find_if(pieces_.begin(), pieces_.end(),
                                    [](const OutlinePiece& p) { return p.kind == Kind::circle; });
    const auto is_other = [&](const OutlinePiece& p) {
      return p.kind != Kind::unsure && !are_alike(p, *first);
    };
    if (first == pieces_.end() || std::any_of(pieces_.begin(), pieces_.end(), is_other)) return std::nullopt;
    const Circle& circle = skins_.circle(first->number);
    double sweep = 0;
    for (const OutlinePiece& piece : pieces_) sweep += sweep_of(piece, circle);
    if (std::fabs(std::fabs(sweep) - 2 * pi) > 1e-6 ||
        !skins_.bounds_all_around(first->number, part_, sweep > 0))
      return std::nullopt;
    arcs = 1, polygons = 0;
    const auto& [x, y] = circle.centre;
    const double bulge = sweep > 0 ? 1 : -1;
    return OutlinePath{{{x - circle.radius, y}, {x + circle.radius, y}}, {bulge, bulge}};
  }

  /// Makes one of two pieces of a circle, and of what is unsure between them, if all is of the circle.
  void join_alike() {
    for (std::size_t i = 0; pieces_.size() > 3 && i < pieces_.size();) {
      OutlinePiece &a = piece(i), &unsure = piece(i + 1), &b = piece(i + 2);
      if (a.kind != Kind::circle || unsure.kind != Kind::unsure || !are_alike(a, b) ||
          !bounds(a, angle(a, a.to()), between(angle(a, a.to()), angle(a, b.from())), Beside::boundary)) {
        ++i;
        continue;
      }
      std::rotate(pieces_.begin(), pieces_.begin() + static_cast<std::ptrdiff_t>(i), pieces_.end());
      pieces_[0].append(std::move(pieces_[1]));
      pieces_[0].append(std::move(pieces_[2]));
      pieces_.erase(pieces_.begin() + 1, pieces_.begin() + 3);
      i = 0;
    }
  }
  OutlinePiece& piece(std::size_t i) { return pieces_[i % pieces_.size()]; }

  // --- where pieces meet ---

  [[nodiscard]] double sweep_of(const OutlinePiece& piece) const {
    return sweep_of(piece, skins_.circle(piece.number));
  }
  /// Whether the circle of a piece bounds the solid, on the same side, from an angle on.
  /// @param sweep to the left; negative: to the right.
  [[nodiscard]] bool bounds(const OutlinePiece& piece, double from, double sweep, Beside beside,
                            bool alone = false) const {
    const CircleSkins::Arc arc{piece.number, part_, sweep_of(piece) > 0, std::min(from, from + sweep),
                               std::fabs(sweep)};
    return skins_.bounds(arc, beside, alone);
  }

  /// Whether a circle passes between two points of a line.
  [[nodiscard]] bool passes_between(const Circle& circle, const Point& a, const Point& b) const {
    const double apart = distance(a, b), rounding = skins_.rounding();
    if (!(apart > rounding)) return false;
    const Point way{(b[0] - a[0]) / apart, (b[1] - a[1]) / apart}, normal{way[1], -way[0]};
    const auto points = meetings(circle, normal, -normal[0] * a[0] - normal[1] * a[1], rounding);
    return std::any_of(points.begin(), points.end(), [&](const Point& p) {
      const double along = (p[0] - a[0]) * way[0] + (p[1] - a[1]) * way[1];
      return along > rounding && along < apart - rounding;
    });
  }

  /// Where the curves of two pieces meet, the nearest first.
  [[nodiscard]] std::vector<Point> meetings_of(const OutlinePiece& a, const OutlinePiece& b) const {
    const double rounding = skins_.rounding();
    std::vector<Point> points;
    if (a.kind == Kind::circle && b.kind == Kind::circle) {
      points = meetings(skins_.circle(a.number), skins_.circle(b.number), rounding);
    } else {
      const bool is_first = a.kind == Kind::line;
      const auto line = network_.table.rounded(is_first ? a.number : b.number);
      points = meetings(skins_.circle(is_first ? b.number : a.number), line.normal, line.offset, rounding);
    }
    const auto key = [&](const Point& p) {
      return std::pair(distance(p, a.to()) + distance(p, b.from()), p);
    };
    std::sort(points.begin(), points.end(), [&](const Point& p, const Point& q) { return key(p) < key(q); });
    return points;
  }

  /// Whether a piece certainly goes on from one of its ends to a point of its line or circle, or is cut off
  /// there.
  /// @param way +1 from its end, -1 from its start. @param other piece, that it meets there. @param unsure
  /// piece between them; null: there is none.
  [[nodiscard]] bool reaches(const OutlinePiece& piece, int way, const Point& point,
                             const OutlinePiece& other, const OutlinePiece* unsure) const {
    const Point& end = way > 0 ? piece.to() : piece.from();
    if (piece.kind == Kind::circle) {
      const double from = angle(piece, end), sweep = between(from, angle(piece, point));
      const bool goes_on = (way * sweep > 0) == (sweep_of(piece) > 0);
      return !goes_on || bounds(piece, from, sweep, Beside::ends);
    }
    return unsure == nullptr ||
           std::none_of(unsure->circles.begin(), unsure->circles.end(), [&](std::uint32_t circle) {
             return circle != other.number && passes_between(skins_.circle(circle), end, point);
           });
  }

  /// Lets two pieces meet, if that is certain.
  /// @param unsure piece between them; null: there is none.
  void join(OutlinePiece& a, OutlinePiece& b, OutlinePiece* unsure) const {
    if (a.kind != Kind::circle && b.kind != Kind::circle) return;
    if (are_alike(a, b)) return;
    for (const Point& p : meetings_of(a, b)) {
      if (!reaches(a, 1, p, b, unsure) || !reaches(b, -1, p, a, unsure)) continue;
      a.end = b.start = p;
      if (unsure != nullptr) unsure->is_bridged = true;
      return;
    }
  }

  /// Lets all pieces meet. @return false: one of them was not as it seemed, and is unsure now.
  bool join_all() {
    for (OutlinePiece& piece : pieces_) piece.start.reset(), piece.end.reset(), piece.is_bridged = false;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (piece(i).kind == Kind::unsure) continue;
      OutlinePiece* const unsure = piece(i + 1).kind == Kind::unsure ? &piece(i + 1) : nullptr;
      OutlinePiece& next = piece(unsure != nullptr ? i + 2 : i + 1);
      if (next.kind != Kind::unsure && &next != &piece(i)) join(piece(i), next, unsure);
    }
    const auto wrong = std::find_if(pieces_.begin(), pieces_.end(),
                                    [&](const OutlinePiece& piece) { return !is_right(piece); });
    if (wrong == pieces_.end()) return true;
    if (wrong->kind == Kind::circle) wrong->circles = {wrong->number};
    wrong->kind = Kind::unsure;
    return false;
  }

  [[nodiscard]] bool is_right(const OutlinePiece& piece) const {
    if (piece.kind == Kind::unsure) return true;
    if (piece.kind == Kind::line) {
      const Point from = piece.start.value_or(piece.from()), to = piece.end.value_or(piece.to());
      const double along = (to[0] - from[0]) * (piece.to()[0] - piece.from()[0]) +
                           (to[1] - from[1]) * (piece.to()[1] - piece.from()[1]);
      return along >= 0 || distance(from, to) <= skins_.rounding();
    }
    const auto [from, sweep] = arc_of(piece);
    const double whole = sweep_of(piece);
    if (std::fabs(sweep) * skins_.circle(piece.number).radius <= skins_.rounding())
      return !bounds(piece, angle(piece, piece.from()), whole, Beside::ends, true);  // nothing of it is left
    if ((sweep < 0) != (whole < 0) || std::fabs(sweep) > 2 * pi) return false;
    return bounds(piece, from, sweep, Beside::ends, true);
  }
  void unite_unsure() {
    std::vector<OutlinePiece> all = std::exchange(pieces_, {});
    for (OutlinePiece& piece : all) add(std::move(piece));
    if (pieces_.size() < 2 || !are_alike(pieces_.back(), pieces_.front())) return;
    pieces_.back().append(std::move(pieces_.front()));
    pieces_.erase(pieces_.begin());
  }

  // --- the path ---

  OutlinePath assembled() {
    OutlinePath path;
    arcs = polygons = 0;
    std::optional<Point> end;
    const auto go_to = [&](const Point& start) {
      if (end && distance(*end, start) > skins_.rounding()) add(path, *end, 0);
    };
    for (const OutlinePiece& piece : pieces_) {
      if (piece.is_bridged) continue;
      if (piece.kind == Kind::circle) {
        const auto [from, sweep] = arc_of(piece);
        const Circle& circle = skins_.circle(piece.number);
        const Point start = piece.start.value_or(circle.at(from));
        go_to(start);
        add_arc(path, start, circle, from, sweep);
        end = piece.end.value_or(circle.at(from + sweep));
        ++arcs;
        continue;
      }
      const Point start = piece.start.value_or(piece.from());
      go_to(start);
      add(path, start, 0);
      for (std::size_t i = 1; i + 1 < piece.corners.size(); ++i) add(path, piece.corners[i], 0);
      end = piece.end.value_or(piece.to());
      if (piece.kind == Kind::unsure) ++polygons;
    }
    if (!path.corners.empty()) go_to(path.corners.front());
    return path;
  }
  /// What leads nowhere is left out.
  void add(OutlinePath& path, const Point& corner, double bulge) const {
    if (!path.corners.empty() && path.bulges.back() == 0 &&
        distance(path.corners.back(), corner) <= skins_.rounding()) {
      path.corners.pop_back();
      path.bulges.pop_back();
    }
    path.corners.push_back(corner);
    path.bulges.push_back(bulge);
  }
  /// In pieces of at most half a turn.
  void add_arc(OutlinePath& path, const Point& start, const Circle& circle, double from, double sweep) const {
    if (std::fabs(sweep) * circle.radius <= skins_.rounding()) return add(path, start, 0);
    const double pieces = std::max(1.0, std::ceil(std::fabs(sweep) / pi - 1e-9)),
                 bulge = std::tan(sweep / pieces / 4);
    for (int i = 0; i < static_cast<int>(pieces); ++i)
      add(path, i == 0 ? start : circle.at(from + i * sweep / pieces), std::clamp(bulge, -1.0, 1.0));
  }
};

/// A path that is one circle, and whether it goes around it to the left.
struct WholeCircle {
  geometry::OutlineArc arc;
  bool is_outer;

  [[nodiscard]] bool is_on(const geometry::OutlineArc& other) const {
    constexpr double rounding = 1e-9;
    return std::hypot(arc.centre[0] - other.centre[0], arc.centre[1] - other.centre[1]) <=
               rounding * arc.radius &&
           std::fabs(arc.radius - other.radius) <= rounding * arc.radius;
  }
};

std::optional<WholeCircle> whole_circle_of(const OutlinePath& path) {
  const std::size_t n = path.corners.size();
  if (n < 2 || path.bulges.size() != n || path.bulges[0] == 0) return std::nullopt;
  const WholeCircle circle{{path.corners[0], path.corners[1], path.bulges[0]}, path.bulges[0] > 0};
  for (std::size_t i = 1; i < n; ++i)
    if (path.bulges[i] == 0 || (path.bulges[i] > 0) != circle.is_outer ||
        !circle.is_on({path.corners[i], path.corners[(i + 1) % n], path.bulges[i]}))
      return std::nullopt;
  return circle;
}

/// A disk in a hole of its own size: there is nothing between.
void drop_circles_between_solids(geometry::PartOutline& outline) {
  std::vector<std::pair<std::size_t, WholeCircle>> circles;
  std::vector<char> goes(outline.paths.size());
  for (std::size_t i = 0; i < outline.paths.size(); ++i) {
    const auto circle = whole_circle_of(outline.paths[i]);
    if (!circle) continue;
    const auto other = std::ranges::find_if(circles, [&](const auto& before) {
      return goes[before.first] == 0 && before.second.is_outer != circle->is_outer &&
             before.second.is_on(circle->arc);
    });
    if (other != circles.end()) {
      goes[i] = goes[other->first] = 1;
      outline.arcs -= 2;
    }
    circles.emplace_back(i, *circle);
  }
  std::size_t at = 0;
  std::erase_if(outline.paths, [&](const OutlinePath&) { return goes[at++] != 0; });
}

}  // namespace

void add_arcs(const Network<2>& network, const CircleSkins& skins, OutlineTracer& tracer,
              geometry::PartOutline& outline) {
  const auto paths = tracer.paths();
  ArcFitter fitter(network, skins, tracer.points(), outline.part);
  std::vector<OutlinePath> unsure;
  for (const auto& traced : paths) {
    OutlinePath polygon{tracer.corners_of(traced), {}};
    if (polygon.corners.size() < 3) continue;
    OutlinePath path = fitter.fit(traced);
    const double before = area_with_arcs(polygon), more = area_with_arcs(path) - before;
    // The cells are in the solid, so it has no less; and no more than what is FUZZY.
    const bool is_polygon =
        path.corners.size() < 2 || !(more >= -1e-9 * std::fabs(before) && more <= skins.area());
    if (fitter.is_unsure() || is_polygon) {
      unsure.push_back(std::move(polygon));
      continue;
    }
    outline.arcs += fitter.arcs;
    outline.polygons += fitter.polygons;
    outline.paths.push_back(fitter.arcs + fitter.polygons == 0 ? std::move(polygon) : std::move(path));
  }
  // Specks of the solid within the skin of a circle are within its arcs by now, and specks of nothing around
  // them.
  std::erase_if(unsure, [&](const OutlinePath& polygon) {
    return contain(outline.paths, some_point(polygon)) == (area_with_arcs(polygon) > 0);
  });
  outline.polygons += static_cast<std::uint32_t>(unsure.size());
  std::move(unsure.begin(), unsure.end(), std::back_inserter(outline.paths));
  drop_circles_between_solids(outline);
}

}  // namespace bsp2::dataflow
