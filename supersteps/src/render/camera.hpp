#pragma once

#include <array>
#include <optional>
#include <vector>

#include "bsp2/geometry/support/vectors.hpp"
#include "bsp2/supersteps/render/rendering.hpp"

/// From model space to the picture: where the viewer stands, and what of the solid fits.
namespace bsp2::supersteps {

using Vector = std::array<double, 3>;
using Point2 = std::array<double, 2>;

using geometry::dot;
inline Vector sum(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vector difference(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector normalized(const Vector& a);
/// Of a plane polygon, counter-clockwise seen from its tip: twice its area long.
Vector normal_of(const std::vector<Vector>& polygon);

/// A box of model space; empty at first. Plane solids have z = 0.
struct Box3 {
  Vector low, high;
  Box3();
  void add(const Vector& p);
  void add(const Box3& other);
  [[nodiscard]] bool is_empty() const { return !(low[0] <= high[0]); }
  [[nodiscard]] Vector middle() const;
  [[nodiscard]] std::array<Vector, 8> corners() const;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    for (int axis = 0; axis < 3; ++axis) archive& low[axis] & high[axis];
  }
};

/// Axes of the picture in model space, to the right, up, and to the viewer, and the eye if it is a
/// perspective picture.
class Camera {
 public:
  /// @param shown what the picture shows. @throws bsp2::Error for an eye that is where it looks.
  Camera(const PictureOptions& options, int dimension, const Box3& shown);

  /// A point in the picture's axes; seen from an eye, which then is the origin, what is before it has z < 0.
  [[nodiscard]] Vector see(const Vector& p) const {
    const Vector q = eye_ ? difference(p, *eye_) : p;
    return {dot(right_, q), dot(up_, q), dot(toward_, q)};
  }
  /// A direction in the picture's axes.
  [[nodiscard]] Vector turn(const Vector& v) const { return {dot(right_, v), dot(up_, v), dot(toward_, v)}; }
  /// Whether a polygon with this normal, through this point, both as seen, shows its front.
  [[nodiscard]] bool shows_front(const Vector& normal, const Vector& point) const {
    return eye_ ? dot(normal, point) < 0 : normal[2] > 0;
  }
  /// What of a seen polygon is before the eye.
  void clip(std::vector<Vector>& polygon) const;
  /// The point of a seen plane (normal and offset) that has this place in the plane of the picture.
  [[nodiscard]] Vector meet(const std::array<double, 4>& plane, const Point2& place) const {
    const double across = plane[0] * place[0] + plane[1] * place[1];
    if (!eye_) return {place[0], place[1], -(across + plane[3]) / plane[2]};
    const double z = -plane[3] / (plane[2] - across);
    return {-z * place[0], -z * place[1], z};
  }
  /// The place of a seen point in the plane of the picture. @pre it is before the eye.
  [[nodiscard]] Point2 project(const Vector& seen) const {
    if (!eye_) return {seen[0], seen[1]};
    return {seen[0] / -seen[2], seen[1] / -seen[2]};
  }
  [[nodiscard]] bool is_before_eye(const Vector& seen) const { return !eye_ || seen[2] <= -near_; }
  [[nodiscard]] bool is_perspective() const { return eye_.has_value(); }
  [[nodiscard]] const Vector& eye() const { return *eye_; }
  [[nodiscard]] Vector direction() const { return {-toward_[0], -toward_[1], -toward_[2]}; }

 private:
  Vector right_{1, 0, 0}, up_{0, 1, 0}, toward_{0, 0, 1};
  std::optional<Vector> eye_;
  double near_ =
      0;  // what is nearer than this has no place of its own in the picture, but what reaches beyond is drawn
};

/// What is to be seen: a rectangle of the plane of the picture; empty at first. From an eye at most 90
/// degrees wide.
struct Extent {
  Point2 low, high;
  Extent();
  void add(const Camera& camera, const Vector& point);
  void add_ball(const Camera& camera, const Vector& middle, double radius);
  void add(const Extent& other);

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& low[0] & low[1] & high[0] & high[1];
  }

 private:
  static constexpr double widest = 1;  // the tangent of half of 90 degrees
  void add_square(const Point2& middle, double half);
};

/// Maps the plane of the picture into its pixels so that the extent fits, with a margin.
class Frame {
 public:
  /// @param look if given, in the middle of the picture.
  Frame(const Camera& camera, Extent extent, const std::optional<Vector>& look, int width, int height);
  [[nodiscard]] Point2 place(const Point2& p) const {
    return {half_[0] + scale_ * (p[0] - middle_[0]), half_[1] - scale_ * (p[1] - middle_[1])};
  }
  /// The place in the plane of the picture.
  [[nodiscard]] Point2 unplace(const Point2& p) const {
    return {middle_[0] + pixel_ * (p[0] - half_[0]), middle_[1] - pixel_ * (p[1] - half_[1])};
  }
  /// Pixels a unit of the plane of the picture.
  [[nodiscard]] double scale() const { return scale_; }

 private:
  double scale_ = 1, pixel_ = 1;  // one by the other
  Point2 middle_{}, half_;
};

}  // namespace bsp2::supersteps
