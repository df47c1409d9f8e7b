#include "constructs/roof.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"

// Notation: an edge runs from a to b with the solid on its left; d is its direction, n its normal to the
// left. In the plane of its face a point is a + s d + h n at the height h. Time is height: the wavefront at
// the time h is the roof's contour there.
namespace bsp2::dataflow {
namespace {

using model::Expression;
using Point = std::array<double, 2>;

Point operator+(const Point& p, const Point& q) { return {p[0] + q[0], p[1] + q[1]}; }
Point operator-(const Point& p, const Point& q) { return {p[0] - q[0], p[1] - q[1]}; }
Point operator*(double t, const Point& p) { return {t * p[0], t * p[1]}; }
double dot(const Point& p, const Point& q) { return p[0] * q[0] + p[1] * q[1]; }
double cross(const Point& p, const Point& q) { return p[0] * q[1] - p[1] * q[0]; }

struct RoofEdge {
  Point a, b, d, n;
  std::vector<std::size_t> from_a, from_b;  // its corners' tracks, one after the other
};

std::vector<RoofEdge> edges_of(const Outline& outline) {
  std::vector<RoofEdge> edges;
  for (const auto& path : outline)
    for (std::size_t i = 0; i < path.size(); ++i) {
      RoofEdge edge{path[i], path[(i + 1) % path.size()], {}, {}, {}, {}};
      const Point along = edge.b - edge.a;
      edge.d = 1 / std::hypot(along[0], along[1]) * along;
      edge.n = {-edge.d[1], edge.d[0]};
      edges.push_back(edge);
    }
  return edges;
}

/// The track of a reflex corner of the wavefront between two edges.
struct Track {
  Point origin, velocity;
  double start;
  std::size_t before, after;  // the edges that meet there
  double end = std::numeric_limits<double>::infinity();
  [[nodiscard]] Point at(double time) const { return origin + (time - start) * velocity; }
};

/// Moves all reflex corners until each has met something.
class Motorcycles {
 public:
  Motorcycles(std::vector<RoofEdge>& edges, const Outline& outline, double height, double grid)
      : edges_(edges), height_(height), grid_(grid) {
    std::size_t first = 0;
    for (const auto& path : outline) {
      for (std::size_t i = 0; i < path.size(); ++i)
        launch(first + (i + path.size() - 1) % path.size(), first + i, path[i], 0);
      first += path.size();
    }
  }

  std::vector<Track> run() {
    while (!crashes_.empty()) {
      const Crash crash = crashes_.top();
      crashes_.pop();
      if (!happens(crash)) continue;
      if (crash.is_meeting(grid_))
        meet(crash);
      else
        tracks_[crash.who].end = crash.time;
    }
    for (Track& track : tracks_) track.end = std::min(track.end, track.start + height_);
    return std::move(tracks_);
  }

 private:
  static constexpr std::size_t wall = ~std::size_t{0};
  struct Crash {
    double time, time_of_other;
    std::size_t who, into;
    [[nodiscard]] bool is_meeting(double grid) const { return into != wall && time - time_of_other <= grid; }
    friend bool operator<(const Crash& x, const Crash& y) {
      return x.time > y.time;
    }  // the queue gives the earliest
  };
  std::vector<RoofEdge>& edges_;
  const double height_, grid_;  // grid: times and places closer than this are one
  std::vector<Track> tracks_;
  std::priority_queue<Crash> crashes_;

  /// Whether both still come that far.
  [[nodiscard]] bool happens(const Crash& crash) const {
    return tracks_[crash.who].end > crash.time &&
           (crash.into == wall || tracks_[crash.into].end + grid_ >= crash.time_of_other);
  }

  /// A track for the corner between two edges, if it is reflex.
  void launch(std::size_t before, std::size_t after, const Point& from, double time) {
    RoofEdge &e = edges_[before], &f = edges_[after];
    if (cross(e.d, f.d) >= -1e-12) return;
    const Point velocity =
        1 / (1 + dot(e.n, f.n)) * (e.n + f.n);  // its distance from both edges grows like the time
    const std::size_t self = tracks_.size();
    tracks_.push_back({from, velocity, time, before, after});
    e.from_b.push_back(self);
    f.from_a.push_back(self);
    for (const RoofEdge& edge : edges_) add_wall(self, edge);
    for (std::size_t other = 0; other < self; ++other) add_meeting(self, other);
  }

  void add_wall(std::size_t self, const RoofEdge& edge) {
    const Track& track = tracks_[self];
    const double det = cross(track.velocity, edge.d);
    if (det == 0) return;
    const double time = cross(edge.a - track.origin, edge.d) / det;
    const double place = dot(track.origin + time * track.velocity - edge.a, edge.d),
                 length = dot(edge.b - edge.a, edge.d);
    if (time > grid_ && place >= -grid_ && place <= length + grid_)
      crashes_.push({track.start + time, 0, self, wall});
  }

  void add_meeting(std::size_t x, std::size_t y) {
    const Track &p = tracks_[x], &q = tracks_[y];
    const Point apart = q.origin - p.origin;
    const double det = cross(p.velocity, q.velocity),
                 speeds = std::hypot(p.velocity[0], p.velocity[1]) * std::hypot(q.velocity[0], q.velocity[1]);
    if (std::fabs(det) <= 1e-12 * speeds) {
      // On one line they can only meet head-on: somebody who follows another is in a track already.
      const double speed = std::hypot(p.velocity[0], p.velocity[1]);
      if (std::fabs(cross(apart, p.velocity)) > grid_ * speed || dot(apart, p.velocity) <= 0 ||
          dot(p.velocity, q.velocity) >= 0)
        return;
      const double both = speed + std::hypot(q.velocity[0], q.velocity[1]);
      const Point p_late = p.at(std::max(p.start, q.start)), q_late = q.at(std::max(p.start, q.start));
      const double time =
          std::max(p.start, q.start) + std::hypot(q_late[0] - p_late[0], q_late[1] - p_late[1]) / both;
      return crashes_.push({time, time, x, y});
    }
    const double s = p.start + cross(apart, q.velocity) / det, t = q.start + cross(apart, p.velocity) / det;
    if (s <= p.start + grid_ || t <= q.start + grid_) return;
    if (s >= t)
      crashes_.push({s, t, x, y});
    else
      crashes_.push({t, s, y, x});
  }

  /// Corners meet: the wavefront comes apart between them, and each part may have a reflex corner there
  /// again.
  void meet(const Crash& first) {
    const Point place = tracks_[first.who].at(first.time);
    std::vector<std::size_t> all{first.who, first.into};
    bool is_new = true;  // nobody was there before
    std::vector<Crash> others;
    for (; !crashes_.empty() && crashes_.top().time <= first.time + grid_; crashes_.pop()) {
      const Crash crash = crashes_.top();
      const Point apart = tracks_[crash.who].at(crash.time) - place;
      if (!happens(crash)) continue;
      if (std::hypot(apart[0], apart[1]) > 4 * grid_) {
        others.push_back(crash);
        continue;
      }
      all.push_back(crash.who);
      if (crash.is_meeting(grid_))
        all.push_back(crash.into);
      else
        is_new = false;
    }
    for (const Crash& crash : others) crashes_.push(crash);
    // Counter-clockwise around the place, by where they come from.
    const auto angle = [&](std::size_t track) {
      return std::atan2(-tracks_[track].velocity[1], -tracks_[track].velocity[0]);
    };
    std::sort(all.begin(), all.end(),
              [&](std::size_t x, std::size_t y) { return std::pair(angle(x), x) < std::pair(angle(y), y); });
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (const std::size_t track : all) tracks_[track].end = std::min(tracks_[track].end, first.time);
    for (std::size_t i = 0; is_new && i < all.size(); ++i) {
      const std::size_t here = all[i], next = all[(i + 1) % all.size()];
      if (part_angle(here, next) > 0) launch(tracks_[next].before, tracks_[here].after, place, first.time);
    }
  }

  /// The angle of the wavefront's part between two tracks that meet, the second one counter-clockwise from
  /// the first; not positive if this part is gone by now, as between the points of a regular star.
  [[nodiscard]] double part_angle(std::size_t here, std::size_t next) const {
    const auto angle = [](const Point& p) { return std::atan2(p[1], p[0]); };
    const auto from = [&](std::size_t track) { return angle(-1.0 * tracks_[track].velocity); };
    const auto turn = [](double a, double b) { return std::remainder(b - a, 2 * std::numbers::pi); };
    double sector = turn(from(here), from(next));
    if (sector <= 0) sector += 2 * std::numbers::pi;
    const double first = turn(from(here), angle(edges_[tracks_[here].after].d)),
                 last = turn(angle(-1.0 * edges_[tracks_[next].before].d), from(next));
    return sector - first - last;
  }
};

using SpacePoints = std::vector<std::array<double, 3>>;

void add_column(SpacePoints& points, const Point& p, double low, double high) {
  points.push_back({p[0], p[1], low});
  points.push_back({p[0], p[1], high});
}

/// What lies above the plane of an edge, between the tracks at its ends.
Expression above(const RoofEdge& edge, const std::vector<Track>& tracks, double height) {
  SpacePoints points;
  add_column(points, edge.a, 0, height);
  add_column(points, edge.b, 0, height);
  double left = 0, right = dot(edge.b - edge.a, edge.d);
  const auto follow = [&](const std::vector<std::size_t>& own, double& reach) {
    for (const std::size_t track : own) {
      const double end = std::min(tracks[track].end, height);
      const Point p = tracks[track].at(end);
      reach = dot(p - edge.a, edge.d);
      add_column(points, edge.a + reach * edge.d + end * edge.n, end, height);
    }
  };
  follow(edge.from_a, left);
  follow(edge.from_b, right);
  add_column(points, edge.a + left * edge.d + height * edge.n, height, height);
  add_column(points, edge.a + right * edge.d + height * edge.n, height, height);
  return model::convex_hull(points);
}

/// What lies above both planes along a track: they only touch there, and rounding must not leave a crack
/// between them.
Expression along(const Track& track, const std::vector<RoofEdge>& edges, double height) {
  SpacePoints points;
  const double end = std::min(track.end, height), time = end - track.start;
  add_column(points, track.origin, track.start, height);
  add_column(points, track.at(end), end, height);
  for (const std::size_t edge : {track.before, track.after})
    add_column(points, track.origin + time * edges[edge].n, end, height);
  return model::convex_hull(points);
}

/// What lies above the distance from an edge: the hull of cones over its ends, whose sides touch the true
/// ones from outside and two of which are the planes of the edge.
Expression above_distance(const RoofEdge& edge, std::uint32_t sides, double height) {
  SpacePoints points{{edge.a[0], edge.a[1], 0}, {edge.b[0], edge.b[1], 0}};
  const double radius = height / model::cosine(180.0 / sides);
  for (std::uint32_t j = 0; j < sides; ++j) {
    const double angle = (j + 0.5) * 360 / sides;
    const Point p = radius * (model::cosine(angle) * edge.n + model::sine(angle) * edge.d);
    for (const Point& end : {edge.a, edge.b}) points.push_back({end[0] + p[0], end[1] + p[1], height});
  }
  return model::convex_hull(points);
}

}  // namespace

std::vector<Expression> pieces_above_roof(const model::Roof& roof, const Outline& outline, double height) {
  std::vector<RoofEdge> edges = edges_of(outline);
  std::vector<Expression> pieces;
  if (roof.method == model::Roof::Method::straight) {
    double reach = 0;
    for (const RoofEdge& edge : edges) reach = std::max({reach, std::fabs(edge.a[0]), std::fabs(edge.a[1])});
    const std::vector<Track> tracks = Motorcycles(edges, outline, height, 1e-10 * reach).run();
    for (const RoofEdge& edge : edges) pieces.push_back(above(edge, tracks, height));
    for (const Track& track : tracks) pieces.push_back(along(track, edges, height));
    return pieces;
  }
  const double asked = model::side_count(height, roof.resolution);
  if (!(asked <= model::max_sides))
    throw Error("roof: more than " + std::to_string(model::max_sides) + " sides of a cone");
  const auto sides = 2 * ((static_cast<std::uint32_t>(asked) + 1) / 2);  // even: both planes of an edge
  for (const RoofEdge& edge : edges) pieces.push_back(above_distance(edge, std::max(sides, 4u), height));
  return pieces;
}

}  // namespace bsp2::dataflow
