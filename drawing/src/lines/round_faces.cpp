#include "lines/round_faces.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::drawing {
namespace {

using geometry::Brep;

using geometry::cross;
using geometry::dot;
using geometry::minus;
Point3 plus(const Point3& a, double s, const Point3& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}

/// An edge between two facets of something round.
struct Rib {
  std::uint32_t edge;
  std::array<std::uint32_t, 2> faces;
  Point3 direction;  ///< of unit length, the first number that is not 0 above it
};

/// What three ribs side by side go around.
struct Axle {
  Point3 direction;  ///< of unit length, the first number that is not 0 above it
  Point3 place;      ///< the point of it that is nearest to the origin
};

/// @param length of the vector.
Point3 pointed(const Point3& v, double length) {
  const auto* first =
      std::find_if(v.begin(), v.end(), [&](double x) { return std::fabs(x) > 1e-9 * length; });
  const double scale = first != v.end() && *first < 0 ? -1 / length : 1 / length;
  return {scale * v[0], scale * v[1], scale * v[2]};
}

Point3 flat(const Point3& p, const Point3& direction) { return plus(p, -dot(p, direction), direction); }

/// Of parallel ribs: the centre of the circle that they are on.
std::optional<Point3> centre_of(const Point3& axis, const Point3& a, const Point3& b, const Point3& c) {
  const Point3 p = flat(a, axis), u = minus(flat(b, axis), p), v = minus(flat(c, axis), p), n = cross(u, v);
  const double area = dot(n, n);
  if (!(area > 1e-12 * dot(u, u) * dot(v, v))) return std::nullopt;
  const double uu = dot(u, u), vv = dot(v, v);
  const Point3 w = plus({-vv * u[0], -vv * u[1], -vv * u[2]}, uu, v);
  return plus(p, 1 / (2 * area), cross(w, n));
}

/// What is found around one axle.
struct Found {
  Axle axle{};
  double radius = 0, low = 0, high = 0;
  std::vector<double> places;  ///< angles of ribs
};

class RoundFinder {
 public:
  RoundFinder(const Brep& brep, double smooth_angle) : brep_(brep), ribs_of_face_(brep.faces.size()) {
    if (brep.points.empty()) return;
    corner_ = brep.points.front();
    for (const Point3& point : brep.points)
      for (std::size_t k = 0; k < 3; ++k) corner_[k] = std::min(corner_[k], point[k]);
    for (const Point3& point : brep.points) {
      points_.push_back(minus(point, corner_));
      for (const double x : points_.back()) size_ = std::max(size_, x);
    }
    for (std::uint32_t i = 0; i < brep.edges.size(); ++i) add_rib(i, smooth_angle * std::numbers::pi / 180);
  }

  std::vector<RoundAxis> axes() {
    for (const Rib& rib : ribs_)
      if (const auto axle = axle_of(rib)) add(rib, *axle);
    std::vector<RoundAxis> axes;
    for (auto& [key, found] : found_)
      if (goes_around(found.places))
        axes.push_back({placed(found.axle, found.low), placed(found.axle, found.high), found.radius});
    return axes;
  }

 private:
  const Brep& brep_;
  Point3 corner_{};             // of the box around all
  std::vector<Point3> points_;  // from there: far from the origin their differences would be lost
  double size_ = 0;
  std::vector<Rib> ribs_;
  std::vector<std::vector<std::uint32_t>> ribs_of_face_;
  std::map<std::array<std::int64_t, 6>, Found> found_;

  [[nodiscard]] const Point3& end(const Rib& rib, std::size_t i = 0) const {
    return points_[brep_.edges[rib.edge].ends[i]];
  }
  [[nodiscard]] Point3 placed(const Axle& axle, double along) const {
    return plus(plus(axle.place, along, axle.direction), 1, corner_);
  }

  void add_rib(std::uint32_t number, double smooth_angle) {
    const Brep::Edge& edge = brep_.edges[number];
    if (edge.count != 2) return;
    const Brep::Use &one = brep_.uses[brep_.uses_of_edges[edge.first]],
                    &other = brep_.uses[brep_.uses_of_edges[edge.first + 1]];
    if (std::fabs(one.angle - std::numbers::pi) >= smooth_angle || one.face == other.face) return;
    const Point3 along = minus(points_[edge.ends[1]], points_[edge.ends[0]]);
    const double length = std::sqrt(dot(along, along));
    if (!(length > 0)) return;
    for (const std::uint32_t face : {one.face, other.face})
      ribs_of_face_[face].push_back(static_cast<std::uint32_t>(ribs_.size()));
    ribs_.push_back({number, {one.face, other.face}, pointed(along, length)});
  }

  static bool are_parallel(const Rib& a, const Rib& b) {
    const Point3 apart = cross(a.direction, b.direction);
    return dot(apart, apart) < 1e-14;
  }
  [[nodiscard]] bool touch(const Rib& a, const Rib& b) const {
    const auto &p = brep_.edges[a.edge].ends, &q = brep_.edges[b.edge].ends;
    return p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1];
  }
  /// Whether two ribs are on one line: an edge in pieces.
  [[nodiscard]] bool are_in_line(const Rib& a, const Rib& b) const {
    const Point3 aside = cross(minus(end(b), end(a)), a.direction);
    return are_parallel(a, b) && dot(aside, aside) <= 1e-16 * size_ * size_;
  }

  /// The rib on the other side of a face.
  [[nodiscard]] const Rib* across(const Rib& rib, std::uint32_t face) const {
    const Rib* found = nullptr;
    for (const std::uint32_t number : ribs_of_face_[face]) {
      const Rib& other = ribs_[number];
      if (are_in_line(rib, other)) continue;
      if (!touch(rib, other)) return &other;
      found = found == nullptr ? &other : &rib;  // of several that touch it, none
    }
    return found == &rib ? nullptr : found;
  }
  /// The facets of spheres have ribs both ways; parallel ones among them are not around their axis.
  [[nodiscard]] bool has_ribs_both_ways(std::uint32_t face) const {
    const auto& ribs = ribs_of_face_[face];
    return std::any_of(ribs.begin(), ribs.end(),
                       [&](std::uint32_t rib) { return !are_parallel(ribs_[rib], ribs_[ribs.front()]); });
  }

  [[nodiscard]] std::optional<Axle> axle_of(const Rib& rib) const {
    const Rib *before = across(rib, rib.faces[0]), *after = across(rib, rib.faces[1]);
    if (before == nullptr || after == nullptr) return std::nullopt;
    if (!are_parallel(rib, *before)) return axle_of_cone(*before, rib, *after);
    if (!are_parallel(rib, *after) || has_ribs_both_ways(rib.faces[0]) || has_ribs_both_ways(rib.faces[1]))
      return std::nullopt;
    const auto centre = centre_of(rib.direction, end(*before), end(rib), end(*after));
    if (!centre) return std::nullopt;
    return Axle{rib.direction, *centre};
  }

  /// Where the lines of two ribs meet.
  [[nodiscard]] std::optional<Point3> meeting(const Rib& a, const Rib& b) const {
    const Point3 n = cross(a.direction, b.direction), apart = minus(end(b), end(a));
    const double nn = dot(n, n);
    if (!(nn > 1e-14) || std::fabs(dot(apart, n)) > 1e-9 * size_ * std::sqrt(nn)) return std::nullopt;
    return plus(end(a), dot(cross(apart, b.direction), n) / nn, a.direction);
  }

  /// Ribs of a cone meet in its apex, and are equally steep.
  [[nodiscard]] std::optional<Axle> axle_of_cone(const Rib& a, const Rib& b, const Rib& c) const {
    const auto apex = meeting(a, b), same = meeting(b, c);
    if (!apex || !same) return std::nullopt;
    const Point3 apart = minus(*apex, *same);
    if (dot(apart, apart) > 1e-14 * (size_ * size_ + dot(*apex, *apex))) return std::nullopt;
    std::array<Point3, 3> spokes;
    for (std::size_t i = 0; i < 3; ++i) {
      const Rib& rib = *std::array{&a, &b, &c}[i];
      const Point3 first = minus(end(rib, 0), *apex), last = minus(end(rib, 1), *apex);
      const Point3& spoke = dot(first, first) > dot(last, last) ? first : last;
      const double length = std::sqrt(dot(spoke, spoke));
      spokes[i] = {spoke[0] / length, spoke[1] / length, spoke[2] / length};
    }
    const Point3 n = cross(minus(spokes[1], spokes[0]), minus(spokes[2], spokes[0]));
    const double length = std::sqrt(dot(n, n));
    if (!(length > 1e-9)) return std::nullopt;
    const Point3 direction = pointed(n, length);
    return Axle{direction, flat(*apex, direction)};
  }

  void add(const Rib& rib, const Axle& axle) {
    if (dot(axle.place, axle.place) > 100 * size_ * size_) return;
    std::array<std::int64_t, 6> key;
    for (std::size_t k = 0; k < 3; ++k) {
      key[k] = quantized(axle.direction[k], 1e-5);
      key[3 + k] = quantized(axle.place[k], 1e-5 * size_);
    }
    auto [at, is_new] = found_.try_emplace(key);
    Found& found = at->second;
    if (is_new) found = {axle, 0, 1e300, -1e300, {}};
    const Point3& axis = found.axle.direction;
    const Point3 side = std::fabs(axis[2]) < 0.9 ? cross(axis, {0, 0, 1}) : cross(axis, {1, 0, 0});
    for (const std::uint32_t point : brep_.edges[rib.edge].ends) {
      const Point3& p = points_[point];
      const Point3 spoke = minus(flat(p, axis), found.axle.place);
      found.low = std::min(found.low, dot(p, axis));
      found.high = std::max(found.high, dot(p, axis));
      found.radius = std::max(found.radius, std::sqrt(dot(spoke, spoke)));
      if (dot(spoke, spoke) > 1e-12 * size_ * size_)
        found.places.push_back(std::atan2(dot(spoke, cross(axis, side)), dot(spoke, side)));
    }
  }

  /// Whether ribs are around half of the axis; those at the ends of a row are not among them.
  static bool goes_around(std::vector<double>& places) {
    if (places.empty()) return false;
    std::sort(places.begin(), places.end());
    double widest = places.front() + 2 * std::numbers::pi - places.back();
    for (std::size_t i = 1; i < places.size(); ++i) widest = std::max(widest, places[i] - places[i - 1]);
    constexpr double half = 150 * std::numbers::pi / 180;
    return 2 * std::numbers::pi - widest >= half;
  }

  /// Shifted by what no model is made of, so that round numbers are not where one step ends.
  static std::int64_t quantized(double x, double step) {
    return static_cast<std::int64_t>(std::floor(x / step + 0.3819660113));
  }
};

}  // namespace

std::vector<RoundAxis> round_axes(const Brep& brep, double smooth_angle) {
  return RoundFinder(brep, smooth_angle).axes();
}

}  // namespace bsp2::drawing
