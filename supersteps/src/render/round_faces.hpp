#pragma once

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

}  // namespace bsp2::supersteps
