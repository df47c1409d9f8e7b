#include "render/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::cross;

double length(const Vector& a) { return std::sqrt(dot(a, a)); }

double diagonal(const Box3& box) { return box.is_empty() ? 0 : length(difference(box.high, box.low)); }

/// To a viewer in front (-y), 30 degrees to the right and 22 degrees above.
Vector default_direction() {
  const double a = 30 * std::numbers::pi / 180, e = 22 * std::numbers::pi / 180;
  return {std::sin(a) * std::cos(e), -std::cos(a) * std::cos(e), std::sin(e)};
}

/// Counter-clockwise as seen from above.
Vector turned(const Vector& a, double degrees) {
  const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
  return {c * a[0] - s * a[1], s * a[0] + c * a[1], a[2]};
}

}  // namespace

Vector normalized(const Vector& a) {
  const double l = length(a);
  return {a[0] / l, a[1] / l, a[2] / l};
}

Vector normal_of(const std::vector<Vector>& polygon) {
  Vector n{};
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vector u = difference(polygon[i - 1], polygon[0]), v = difference(polygon[i], polygon[0]);
    for (int k = 0; k < 3; ++k) n[k] += u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  }
  return n;
}

Box3::Box3() {
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
}

void Box3::add(const Vector& p) {
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(low[axis], p[axis]);
    high[axis] = std::max(high[axis], p[axis]);
  }
}

void Box3::add(const Box3& other) {
  if (other.is_empty()) return;
  add(other.low);
  add(other.high);
}

Vector Box3::middle() const {
  if (is_empty()) return {};
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
}

std::array<Vector, 8> Box3::corners() const {
  std::array<Vector, 8> result;
  for (unsigned corner = 0; corner < 8; ++corner)
    for (unsigned axis = 0; axis < 3; ++axis)
      result[corner][axis] = corner >> axis & 1 ? high[axis] : low[axis];
  return result;
}

namespace {

/// In sizes of what is shown. Beyond, the picture is the same, and doubles do not tell what is in front.
constexpr double farthest = 1e6;

/// Makes a way about as long as that if it is longer. @return whether it was.
bool comes_nearer(Vector& way, double most) {
  const double size = std::max({std::fabs(way[0]), std::fabs(way[1]), std::fabs(way[2])});
  if (!(most > 0) || !(size > most)) return false;
  for (double& x : way) x *= most / size;
  return true;
}

}  // namespace

Camera::Camera(const PictureOptions& options, int dimension, const Box3& shown) {
  if (dimension == 2 && !options.eye) return;
  if (options.eye) {
    const Vector looked_at = options.look.value_or(shown.middle());
    Vector back = difference(*options.eye, looked_at);
    const bool is_nearer = comes_nearer(back, farthest * diagonal(shown));
    if (!(length(back) > 0))
      throw Error("the eye is where it looks, at (" + std::to_string(looked_at[0]) + ", " +
                  std::to_string(looked_at[1]) + ", " + std::to_string(looked_at[2]) +
                  "): choose another --eye or --look");
    const Vector way = turned(back, options.turn);
    eye_ = options.turn == 0 && !is_nearer ? *options.eye : sum(looked_at, way);
    toward_ = normalized(way);
    near_ = 1e-4 * std::max(diagonal(shown), length(back));
  } else {
    toward_ = turned(default_direction(), options.turn);
  }
  right_ = cross({0, 0, 1}, toward_);
  right_ = length(right_) > 1e-9 ? normalized(right_)
                                 : Vector{1, 0, 0};  // straight down or up: +x is to the right
  up_ = cross(toward_, right_);
}

void Camera::clip(std::vector<Vector>& polygon) const {
  if (std::all_of(polygon.begin(), polygon.end(), [this](const Vector& p) { return is_before_eye(p); }))
    return;
  // What is near goes on far beside the picture. So it is cut off there first, and then the rest may come as
  // near as it likes.
  constexpr double widest = 500, nearest = 1e-9;  // the tangent to each side; in `near_`
  const auto cut = [&](const auto& inside) {
    std::vector<Vector> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double x = inside(p), y = inside(q);
      if (x >= 0) kept.push_back(p);
      if ((x < 0) == (y < 0)) continue;
      const double t = x / (x - y);
      kept.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])});
    }
    polygon = std::move(kept);
  };
  for (const int axis : {0, 1})
    for (const double side : {1.0, -1.0})
      cut([&](const Vector& p) { return -widest * p[2] + side * p[axis]; });
  cut([&](const Vector& p) { return -p[2] - nearest * near_; });
}

Extent::Extent() {
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
}

void Extent::add(const Camera& camera, const Vector& point) {
  const Vector seen = camera.see(point);
  for (int axis = 0; axis < 2; ++axis) {
    double x = std::copysign(widest, seen[axis]);  // of what is behind the eye
    if (camera.is_before_eye(seen)) x = camera.project(seen)[axis];
    if (camera.is_perspective()) x = std::clamp(x, -widest, widest);
    low[axis] = std::min(low[axis], x);
    high[axis] = std::max(high[axis], x);
  }
}

void Extent::add_ball(const Camera& camera, const Vector& middle, double radius) {
  const Vector seen = camera.see(middle);
  const double distance = std::sqrt(dot(seen, seen));
  if (camera.is_perspective() && !(distance > radius)) return add_square({0, 0}, widest);
  if (!camera.is_perspective()) return add_square({seen[0], seen[1]}, radius);
  // Where the ball is in the middle of the picture; it is looked at.
  add_square(camera.is_before_eye(seen) ? camera.project(seen) : Point2{},
             std::min(widest, radius / std::sqrt(distance * distance - radius * radius)));
}

void Extent::add_square(const Point2& middle, double half) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    low[axis] = std::min(low[axis], middle[axis] - half);
    high[axis] = std::max(high[axis], middle[axis] + half);
  }
}

void Extent::add(const Extent& other) {
  for (int axis = 0; axis < 2; ++axis) {
    low[axis] = std::min(low[axis], other.low[axis]);
    high[axis] = std::max(high[axis], other.high[axis]);
  }
}

Frame::Frame(const Camera& camera, Extent extent, const std::optional<Vector>& look, int width, int height)
    : half_{width / 2.0, height / 2.0} {
  constexpr double margin = 0.05;
  auto& [low, high] = extent;
  if (!(low[0] <= high[0])) return;
  middle_ = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
  if (look) middle_ = camera.is_perspective() ? Point2{} : camera.project(camera.see(*look));
  double scale = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 2; ++axis) {
    const double reach = std::max(high[axis] - middle_[axis], middle_[axis] - low[axis]);
    if (reach > 0) scale = std::min(scale, half_[axis] * (1 - 2 * margin) / reach);
  }
  if (!std::isfinite(scale)) return;
  scale_ = scale;
  pixel_ = 1 / scale;
}

}  // namespace bsp2::supersteps
