#include "render/round_faces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace bsp2::supersteps {
namespace {

using dataflow::ProducerKind;

double length(const Point2& a) { return std::hypot(a[0], a[1]); }
Vector unit_of(const Vector& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}
Point2 unit(const Point2& a) { return {a[0] / length(a), a[1] / length(a)}; }

/// Facets come in the order of a lathe: the caps, then side by side the bands.
std::optional<std::uint32_t> segment_of(const dataflow::TurnedShape& shape, std::uint32_t facet) {
  const std::uint32_t bottom = shape.rings.front().first > 0 ? 1 : 0,
                      top = shape.rings.back().first > 0 ? 1 : 0;
  const auto bands = static_cast<std::uint32_t>(shape.rings.size() - 1);
  if (facet < bottom) return 0;
  if (facet < bottom + top) return bottom + bands;
  if (facet >= bottom + top + shape.sides * bands) return std::nullopt;
  return bottom + (facet - bottom - top) % bands;
}

}  // namespace

RoundFaces::RoundFaces(const dataflow::Network<3>& network) : planes_(network.table.size()) {
  add_turned(network);
  first_curved_ = static_cast<std::int32_t>(bodies_.size());
  add_curved(network);
}

/// A frame may be longer along z than across: then it is drawn out, so that angles are those of the model.
template <typename Inverse>
RoundFaces::Body RoundFaces::placed(const Inverse& to_frame, bool is_turned) const {
  Body body;
  for (std::size_t i = 0; i < 3; ++i) {
    std::copy_n(to_frame.matrix[i].begin(), 3, body.placement.to_frame[i].begin());
    body.placement.origin[i] = to_frame.origin[i];
  }
  if (!is_turned) return body;
  const double across = std::sqrt(dot(body.placement.to_frame[0], body.placement.to_frame[0])),
               along = std::sqrt(dot(body.placement.to_frame[2], body.placement.to_frame[2]));
  for (double& entry : body.placement.to_frame[2]) entry *= across / along;
  return body;
}

std::vector<RoundFaces::Segment> RoundFaces::segments(std::vector<Point2> profile) {
  if (profile.front()[0] > 0) profile.insert(profile.begin(), {0, profile.front()[1]});
  if (profile.back()[0] > 0) profile.push_back({0, profile.back()[1]});
  std::vector<Segment> result;
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Point2 &a = profile[i], &b = profile[i + 1], normal = unit({b[1] - a[1], a[0] - b[0]});
    result.push_back({{a, b}, {normal, normal}});
  }
  const double least_cosine = std::cos(smooth_angle * std::numbers::pi / 180);
  for (std::size_t i = 0; i + 1 < result.size(); ++i) {
    Point2 &before = result[i].normals[1], &after = result[i + 1].normals[0];
    if (before[0] * after[0] + before[1] * after[1] <= least_cosine) continue;
    before = after = unit({before[0] + after[0], before[1] + after[1]});
  }
  return result;
}

RoundFaces::Segment RoundFaces::side_of_cone(double bottom, double top) {
  const Point2 normal = unit({1, bottom - top});
  return {{Point2{bottom, 0}, Point2{top, 1}}, {normal, normal}};
}

void RoundFaces::add_turned(const dataflow::Network<3>& network) {
  const auto& table = network.table;
  std::vector<std::pair<std::uint32_t, const dataflow::TurnedShape*>> shapes;  // by body
  std::vector<std::int32_t> body_of_map;
  for (const dataflow::Turned& turned : network.turned) {
    if (turned.shape->sides * smooth_angle <= 360) continue;
    const auto inverse = table.map(turned.map).inverse(table.radius());
    Body body = placed(inverse, true);
    const double along =
        std::sqrt(dot(body.placement.to_frame[2], body.placement.to_frame[2]) /
                  dot(Vector{inverse.matrix[2][0], inverse.matrix[2][1], inverse.matrix[2][2]},
                      Vector{inverse.matrix[2][0], inverse.matrix[2][1], inverse.matrix[2][2]}));
    if (!std::isfinite(along)) continue;
    std::vector<Point2> profile;
    for (const auto& [radius, z] : turned.shape->rings) profile.push_back({radius, along * z});
    body.segments = segments(std::move(profile));
    body.inner = std::cos(std::numbers::pi / turned.shape->sides);
    body_of_map.resize(std::max<std::size_t>(body_of_map.size(), turned.map + 1), -1);
    body_of_map[turned.map] = static_cast<std::int32_t>(bodies_.size());
    bodies_.push_back(std::move(body));
    shapes.emplace_back(turned.map, turned.shape.get());
  }
  if (bodies_.empty()) return;
  of_plane_.resize(table.size());
  for (geometry::HyperplaneId id = 0; id < table.size(); ++id) {
    const auto* source = table.source(id);
    if (source == nullptr || source->map >= body_of_map.size() || body_of_map[source->map] < 0) continue;
    const std::int32_t body = body_of_map[source->map];
    const dataflow::TurnedShape& shape = *shapes[static_cast<std::size_t>(body)].second;
    if (const auto segment = segment_of(shape, source->covector - shape.first_covector))
      of_plane_[id] = {body, *segment};
  }
}

void RoundFaces::add_curved(const dataflow::Network<3>& network) {
  const auto add = [&](Body body, const dataflow::Producer<3>& producer, geometry::HyperplaneId first,
                       std::uint32_t count) {
    body.owner = {producer.primitive, producer.part, producer.owns};
    families_.push_back({first, first + count, static_cast<std::int32_t>(bodies_.size())});
    bodies_.push_back(std::move(body));
  };
  for (const auto& producer : network.producers) {
    if (producer.is_empty()) continue;
    if (producer.kind != ProducerKind::round) continue;
    const auto& solid = network.rounds[producer.index];
    if (const auto* round = std::get_if<dataflow::Round<3>>(&solid)) {
      Body body = placed(round->to_frame, false);
      if (round->family.axes() == 3)
        body.kind = Kind::ball;
      else
        body.segments = {side_of_cone(round->family.bottom(), round->family.top())};
      add(std::move(body), producer, round->first, round->family.count());
    } else if (const auto* torus = std::get_if<dataflow::Torus>(&solid)) {
      Body body = placed(torus->to_frame, false);
      body.kind = Kind::torus;
      body.inner = torus->family.minor();
      add(std::move(body), producer, torus->first, torus->family.count());
    }
  }
  std::sort(families_.begin(), families_.end(),
            [](const Family& a, const Family& b) { return a.first < b.first; });
}

RoundPlace RoundFaces::of(geometry::HyperplaneId hyperplane) const {
  if (hyperplane < of_plane_.size()) return of_plane_[hyperplane];
  auto after =
      std::upper_bound(families_.begin(), families_.end(), hyperplane,
                       [](geometry::HyperplaneId id, const Family& family) { return id < family.first; });
  if (after == families_.begin() || hyperplane >= (--after)->end) return {};
  return {after->body, 0};
}

std::vector<RoundFaces::Placement> RoundFaces::seen(const Camera& camera) const {
  std::vector<Placement> result;
  result.reserve(bodies_.size());
  for (const Body& body : bodies_) {
    Placement& seen = result.emplace_back();
    seen.origin = camera.see(body.placement.origin);
    for (std::size_t i = 0; i < 3; ++i) seen.to_frame[i] = camera.turn(body.placement.to_frame[i]);
  }
  return result;
}

double RoundFaces::distance(std::int32_t number, const Vector& point) const {
  const Body& body = bodies_[static_cast<std::size_t>(number)];
  const auto& [x, y, z] = body.placement.to_frame;
  const Vector way = difference(point, body.placement.origin), q{dot(x, way), dot(y, way), dot(z, way)};
  const double radius = std::sqrt(q[0] * q[0] + q[1] * q[1]), unit = std::sqrt(dot(x, x));
  if (body.kind == Kind::ball) return std::fabs(std::sqrt(dot(q, q)) - 1) / unit;
  if (body.kind == Kind::torus) return std::fabs(std::hypot(radius - 1, q[2]) - body.inner) / unit;
  constexpr double slack = 1e-2;  // beyond its ends is nothing of it
  if (q[2] < -slack || q[2] > 1 + slack) return std::numeric_limits<double>::infinity();
  const Segment& side = body.segments.front();
  const double at = side.ends[0][0] + q[2] * (side.ends[1][0] - side.ends[0][0]);
  return std::fabs(radius - at) / unit;
}

namespace {

/// What of a vector is across all of some that are of length 1 and across each other.
Vector across(Vector v, std::span<const Vector> others) {
  for (const Vector& other : others) {
    const double along = dot(v, other);
    for (std::size_t k = 0; k < 3; ++k) v[k] -= along * other[k];
  }
  return v;
}

Vector moved(const Vector& point, double by, const Vector& way) {
  return {point[0] + by * way[0], point[1] + by * way[1], point[2] + by * way[2]};
}

}  // namespace

std::optional<Vector> RoundFaces::place_on(
    std::span<const std::uint32_t> planes, const Vector& point,
    const std::function<Vector(geometry::HyperplaneId)>& normal_of) const {
  constexpr double least_slope = 1e-2;
  std::vector<std::int32_t> bodies;
  std::vector<Vector> kept;  // normals of planes that it stays in
  for (const std::uint32_t plane : planes) {
    const auto id = static_cast<geometry::HyperplaneId>(plane);
    if (const RoundPlace place = of(id); place.body >= 0 && is_curved(place.body)) {
      if (std::ranges::find(bodies, place.body) == bodies.end()) bodies.push_back(place.body);
    } else if (is_of_model(id)) {
      const Vector normal = across(unit_of(normal_of(id)), kept);
      if (dot(normal, normal) > least_slope * least_slope) kept.push_back(unit_of(normal));
    }
  }
  if (bodies.empty() || bodies.size() + kept.size() > 3) return std::nullopt;
  Vector at = point;
  double before = 0;
  for (const std::int32_t body : bodies) before = std::max(before, distance(body, at));
  if (!std::isfinite(before)) return std::nullopt;
  const double enough = 1e-6 * before;
  for (int step = 0; step < 20; ++step) {
    bool is_there = true;
    for (const std::int32_t body : bodies) {
      const double away = distance(body, at);
      if (!std::isfinite(away)) return std::nullopt;
      if (away <= enough) continue;
      is_there = false;
      const Vector way = across(normal({body, 0, 1}, at, {1, 0, 0}), kept);
      if (!(dot(way, way) > least_slope)) return std::nullopt;
      // Distances are about: how much they change on the way is measured.
      const double little = away / 8;
      const double slope =
          (distance(body, moved(at, little, way)) - distance(body, moved(at, -little, way))) / (2 * little);
      if (!(std::fabs(slope) > least_slope)) return std::nullopt;
      at = moved(at, -away / slope, way);
    }
    if (is_there) return at;
  }
  return std::nullopt;
}

}  // namespace bsp2::supersteps
