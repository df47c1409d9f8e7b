#include "bsp2/model/expression/tessellation.hpp"

#include <cmath>
#include <numbers>

namespace bsp2::model {

namespace {
constexpr double smallest_radius = 0x1p-20;  // below it OpenSCAD does not look at the resolution
constexpr double smallest_step = 0.01;       // of $fa and $fs
}  // namespace

double side_count(double radius, const Resolution& resolution) {
  if (radius < smallest_radius || !std::isfinite(resolution.fn)) return 3;
  if (resolution.fn > 0) return std::fmax(std::trunc(resolution.fn), 3);
  const double fa = resolution.fa < smallest_step ? smallest_step : resolution.fa;
  const double fs = resolution.fs < smallest_step ? smallest_step : resolution.fs;
  // fmin and fmax pass over NaN, as OpenSCAD's do.
  return std::ceil(std::fmax(std::fmin(360 / fa, radius * 2 * std::numbers::pi / fs), 5));
}

double sine(double degrees) {
  double angle = std::fmod(degrees, 360);
  double sign = 1;
  if (angle < 0) angle = -angle, sign = -sign;
  if (angle > 180) angle = 360 - angle, sign = -sign;
  if (angle > 90) angle = 180 - angle;
  if (angle == 0) return 0;
  if (angle == 30) return sign * 0.5;
  constexpr double radians = std::numbers::pi / 180;
  return sign * (angle > 45 ? std::cos((90 - angle) * radians) : std::sin(angle * radians));
}

double cosine(double degrees) { return sine(90 - std::fabs(std::fmod(degrees, 360))); }

}  // namespace bsp2::model
