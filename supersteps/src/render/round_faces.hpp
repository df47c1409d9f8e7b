#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "render/ink.hpp"

namespace bsp2::supersteps {

/// The round primitives of a model: cylinders, cones, balls and tori, whether they are truly round or made of
/// facets that meet in less than 30 degrees. By them facets are lit as if they were bent. D = 3.
///
/// Rounded: it is for pictures. Any number of threads may ask.
class RoundFaces {
 public:
  RoundFaces() = default;
  explicit RoundFaces(const dataflow::Network<3>& network);

  [[nodiscard]] bool is_empty() const { return bodies_.empty(); }
  [[nodiscard]] RoundPlace of(geometry::HyperplaneId hyperplane) const;
  /// Where each body's own frame is: rows of the map into it, and its origin.
  struct Placement {
    std::array<Vector, 3> to_frame{};
    Vector origin{};
  };
  /// As a camera sees them.
  [[nodiscard]] std::vector<Placement> seen(const Camera& camera) const;
  /// The normal of what is round near a point of a facet, on the side of the facet's own one; that one where
  /// the point does not lie where the facet should. Of unit length.
  /// @param placement of the body, and the others, in one system of axes.
  [[nodiscard]] Vector normal(const RoundPlace& place, const Placement& placement, const Vector& point,
                              const Vector& of_facet) const;
  /// In the model.
  [[nodiscard]] Vector normal(const RoundPlace& place, const Vector& point, const Vector& of_facet) const {
    return normal(place, bodies_[static_cast<std::size_t>(place.body)].placement, point, of_facet);
  }
  /// Whether it is truly round, and not made of facets.
  [[nodiscard]] bool is_curved(std::int32_t body) const { return body >= first_curved_; }
  /// Whether the hyperplane is one of the model, and not a cut, nor of what encloses a curved solid.
  [[nodiscard]] bool is_of_model(geometry::HyperplaneId hyperplane) const { return hyperplane < planes_; }
  [[nodiscard]] bool has_curved() const { return first_curved_ < static_cast<std::int32_t>(bodies_.size()); }
  /// How far a point of the model is from the surface of what is truly round, about.
  [[nodiscard]] double distance(std::int32_t body, const Vector& point) const;
  /// Where a point belongs that is on these planes: on the surfaces of what is truly round that some of them
  /// enclose, and in those that are of the model. By Newton's method; @param normal_of a plane.
  /// @return none if nothing there is truly round, or that has no end.
  [[nodiscard]] std::optional<Vector> place_on(
      std::span<const std::uint32_t> planes, const Vector& point,
      const std::function<Vector(geometry::HyperplaneId)>& normal_of) const;
  /// What the solid behind it belongs to; of a hole: what made it.
  struct Owner {
    std::int32_t primitive = geometry::no_primitive, part = geometry::no_part;
    bool owns = true;  ///< it is no hole
  };
  [[nodiscard]] const Owner& owner(const RoundPlace& place) const {
    return bodies_[static_cast<std::size_t>(place.body)].owner;
  }

 private:
  /// What turns around z: from one (radius, z) to the next. The normals at its ends are those of the segment,
  /// or between those of two that meet in a small angle.
  struct Segment {
    std::array<Point2, 2> ends, normals;
  };
  enum class Kind : std::uint8_t { turned, ball, torus };
  struct Body {
    Kind kind = Kind::turned;
    Placement placement;  ///< in the model
    std::vector<Segment> segments;
    double inner =
        1;  ///< the radius of the circle in the polygon, relative to that around it; of a torus, of its tube
    Owner owner;
  };
  struct Family {
    geometry::HyperplaneId first = 0, end = 0;
    std::int32_t body = 0;
  };
  std::vector<Body> bodies_;
  std::int32_t first_curved_ = 0;     ///< those from here on are truly round
  std::size_t planes_ = 0;            ///< of the model
  std::vector<RoundPlace> of_plane_;  ///< by id
  std::vector<Family> families_;      ///< ascending

  static constexpr double smooth_angle = 30;  // degrees
  template <typename Inverse>
  Body placed(const Inverse& to_frame, bool is_turned) const;
  static std::vector<Segment> segments(std::vector<Point2> profile);
  static Segment side_of_cone(double bottom, double top);
  void add_turned(const dataflow::Network<3>& network);
  void add_curved(const dataflow::Network<3>& network);
  [[nodiscard]] static std::optional<Vector> frame_normal(const Body& body, std::uint32_t segment,
                                                          const Vector& q);
};

// Asked for each pixel.
/// A covector: the map takes it into the model by its transpose.
inline std::optional<Vector> RoundFaces::frame_normal(const Body& body, std::uint32_t number,
                                                      const Vector& q) {
  if (body.kind == Kind::ball) return q;
  const double radius = std::sqrt(q[0] * q[0] + q[1] * q[1]);
  if (body.kind == Kind::torus) {
    if (!(radius > 0)) return std::nullopt;
    return Vector{q[0] * (radius - 1) / radius, q[1] * (radius - 1) / radius, q[2]};
  }
  if (number >= body.segments.size()) return std::nullopt;
  const Segment& segment = body.segments[number];
  const Point2 &a = segment.ends[0], &b = segment.ends[1], way{b[0] - a[0], b[1] - a[1]};
  const bool is_level = way[1] == 0;
  const double t = is_level ? (radius - a[0]) / way[0] : (q[2] - a[1]) / way[1];
  if (!is_level) {  // other facets of the same hyperplane are elsewhere
    constexpr double slack = 1e-6;
    const double around = a[0] + t * way[0], most = (1 + slack) * around + slack;
    if (body.inner < 1 && (radius > most || radius < (body.inner - slack) * around - slack))
      return std::nullopt;
  }
  const double s = std::clamp(t, 0.0, 1.0);
  const Point2 &n = segment.normals[0], &m = segment.normals[1];
  const Point2 normal{n[0] + s * (m[0] - n[0]), n[1] + s * (m[1] - n[1])};
  if (!(radius > 0)) return Vector{0, 0, normal[1]};
  return Vector{q[0] / radius * normal[0], q[1] / radius * normal[0], normal[1]};
}

inline Vector RoundFaces::normal(const RoundPlace& place, const Placement& placement, const Vector& point,
                                 const Vector& of_facet) const {
  const auto& [x, y, z] = placement.to_frame;
  const Vector way = difference(point, placement.origin);
  const auto n = frame_normal(bodies_[static_cast<std::size_t>(place.body)], place.segment,
                              {dot(x, way), dot(y, way), dot(z, way)});
  if (!n) return of_facet;
  Vector normal;
  for (std::size_t k = 0; k < 3; ++k) normal[k] = (*n)[0] * x[k] + (*n)[1] * y[k] + (*n)[2] * z[k];
  const double squared = dot(normal, normal);
  if (!(squared > 0)) return of_facet;
  const bool is_turned = place.side != 0 ? place.side < 0 : dot(normal, of_facet) < 0;
  const double scale = (is_turned ? -1 : 1) / std::sqrt(squared);
  return {scale * normal[0], scale * normal[1], scale * normal[2]};
}

}  // namespace bsp2::supersteps
