#include "serving/gaze.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace bsp2::api {
namespace {

using nlohmann::json;

std::optional<double> number_in(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number() || !std::isfinite(found->get<double>()))
    return std::nullopt;
  return found->get<double>();
}

bool flag_in(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_boolean() && found->get<bool>();
}

/// The elements of an array that has one.
json list_in(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_array() ? *found : json::array();
}

std::optional<Gaze::Point> point_in(const json& object, const char* name) {
  const json list = list_in(object, name);
  Gaze::Point point{};
  if (list.size() != point.size()) return std::nullopt;
  for (std::size_t i = 0; i < point.size(); ++i) {
    if (!list[i].is_number() || !std::isfinite(list[i].get<double>())) return std::nullopt;
    point[i] = list[i].get<double>();
  }
  return point;
}

/// Each as its axis, where it is, and the side of it that is kept.
std::vector<Gaze::Plane> planes_in(const json& object) {
  std::vector<Gaze::Plane> planes;
  for (const json& each : list_in(object, "planes")) {
    if (!each.is_array() || each.size() != 3 || !each[0].is_number_unsigned() || each[0] > 2) continue;
    if (!each[1].is_number() || !std::isfinite(each[1].get<double>()) || !each[2].is_number()) continue;
    const Gaze::Plane plane{each[0].get<std::size_t>(), each[1].get<double>(), each[2].get<double>() > 0};
    const bool is_new = std::none_of(planes.begin(), planes.end(),
                                     [&](const Gaze::Plane& other) { return other.axis == plane.axis; });
    if (is_new) planes.push_back(plane);
  }
  return planes;
}

/// A corner of a box, as it is seen.
struct Corner {
  std::array<double, 3> place;
  double depth;
};

std::array<Corner, 8> corners_of(const Gaze::Point& lower, const Gaze::Point& upper,
                                 const std::array<double, 16>& matrix) {
  std::array<Corner, 8> corners{};
  for (unsigned i = 0; i < 8; ++i) {
    std::array<double, 4> seen{};
    for (unsigned row = 0; row < 4; ++row) {
      seen[row] = matrix[12 + row];
      for (unsigned axis = 0; axis < 3; ++axis)
        seen[row] += matrix[4 * axis + row] * ((i >> axis & 1U) != 0 ? upper : lower)[axis];
    }
    corners[i] = {{seen[0], seen[1], seen[2]}, seen[3]};
  }
  return corners;
}

/// Pixels of a rectangle around a box that is before the eye.
double area_of(const std::array<Corner, 8>& corners, double half_width, double half_height) {
  std::array<double, 2> low{1e300, 1e300}, high{-1e300, -1e300};
  for (const Corner& corner : corners)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double at = corner.place[axis] / corner.depth * (axis == 0 ? half_width : half_height);
      low[axis] = std::min(low[axis], at);
      high[axis] = std::max(high[axis], at);
    }
  return std::max(1.0, high[0] - low[0]) * std::max(1.0, high[1] - low[1]);
}

/// Whether one of the planes around the picture has all of them beyond it.
bool are_outside(const std::array<Corner, 8>& corners) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0})
      if (std::all_of(corners.begin(), corners.end(),
                      [&](const Corner& corner) { return side * corner.place[axis] > corner.depth; }))
        return true;
  return false;
}

double nearest_of(const std::array<Corner, 8>& corners) {
  return std::min_element(corners.begin(), corners.end(),
                          [](const Corner& a, const Corner& b) { return a.depth < b.depth; })
      ->depth;
}

/// The level of what may have so many triangles.
/// @param seen the one whose step is as small as can be seen.
int level_with(const Detail& detail, int seen, double most) {
  const int first = std::clamp(std::min(seen, detail.whole), detail.finest, detail.coarsest);
  constexpr int most_levels = 1;  // above that of half a pixel: a pixel
  int level = first;
  while (level < std::min(seen + most_levels, detail.whole) && detail.triangles_at(level) > most) ++level;
  if (detail.triangles_at(level) <= most || detail.triangles_of_voxels.empty()) return level;
  return detail.voxels_with(most, seen + most_levels);
}

}  // namespace

std::optional<Gaze> Gaze::heard(const std::string& text) {
  const json said = json::parse(text, nullptr, false);
  if (!said.is_object()) return std::nullopt;
  const auto number = number_in(said, "gaze"), height = number_in(said, "height");
  const json matrix = list_in(said, "matrix");
  constexpr double most_numbers = 1e15;
  if (!number || *number < 0 || *number > most_numbers || !height || *height < 0 || matrix.size() != 16)
    return std::nullopt;
  Gaze gaze;
  gaze.number = static_cast<std::uint64_t>(*number);
  gaze.height = *height;
  for (std::size_t i = 0; i < 16; ++i) {
    if (!matrix[i].is_number() || !std::isfinite(matrix[i].get<double>())) return std::nullopt;
    gaze.matrix[i] = matrix[i].get<double>();
  }
  gaze.explode = std::max(0.0, number_in(said, "explode").value_or(0));
  gaze.middle = point_in(said, "middle").value_or(Point{});
  gaze.planes = planes_in(said);
  gaze.wants_surface = flag_in(said, "surface");
  for (const json& part : list_in(said, "hidden"))
    if (part.is_number_integer()) gaze.hidden.insert(part.get<std::int32_t>());
  for (const auto& [name, kind] :
       {std::pair{"pieces", Detail::Kind::surface}, {"regions", Detail::Kind::cells}})
    for (const json& each : list_in(said, name))
      if (each.is_number_unsigned()) gaze.exactly.emplace(kind, each.get<std::uint32_t>());
  return gaze;
}

std::optional<double> Gaze::half_pixel(const Point& lower, const Point& upper, double& pixels) const {
  constexpr double steps_of_a_pixel = 2, most_aspect = 100;
  const auto corners = corners_of(lower, upper, matrix);
  const double nearest = nearest_of(corners);
  if (!(nearest > 0)) return std::nullopt;  // also where products were too large for numbers
  const double growth = std::hypot(matrix[1], matrix[5], matrix[9]);  // of what is upright, at depth 1
  const double step = 2 * nearest / (growth * std::max(1.0, height)) / steps_of_a_pixel;
  if (!std::isfinite(step) || !(step > 0)) return std::nullopt;
  const double across = std::hypot(matrix[0], matrix[4], matrix[8]), half_height = height / 2;
  const double half_width = half_height * growth / std::max(across, growth / most_aspect);
  pixels = area_of(corners, half_width, half_height);
  return step;
}

Gaze::Wanted Gaze::wanted(const Detail& detail, std::uint64_t run_of_surface, const Point& shift) const {
  constexpr double triangles_of_a_pixel = 2;
  constexpr double least_triangles = 24;  // a box of what is IN, and one of what is FUZZY
  if (!shows(detail, run_of_surface) || hidden.contains(detail.part)) return {Detail::nothing, 0, false};
  if (exactly.contains({detail.kind, detail.number})) return {detail.finest, 0, true};
  Point lower = detail.lower, upper = detail.upper;
  for (std::size_t i = 0; i < 3; ++i) {
    lower[i] += shift[i];
    upper[i] += shift[i];
  }
  const Point all_lower = lower, all_upper = upper;
  bool is_away = false;
  for (const auto& [axis, at, keeps_above] : planes) {
    is_away = is_away || (keeps_above ? upper[axis] < at : lower[axis] > at);
    double& end = keeps_above ? lower[axis] : upper[axis];
    end = keeps_above ? std::max(end, at) : std::min(end, at);
  }
  double pixels = 0, seen_pixels = 0;
  const auto whole_step = half_pixel(all_lower, all_upper, pixels),
             step = half_pixel(lower, upper, seen_pixels);
  if (!whole_step) pixels = seen_pixels;  // it reaches behind the eye
  const double most = std::max(least_triangles, triangles_of_a_pixel * pixels);
  const auto corners = corners_of(lower, upper, matrix);
  if (is_away || are_outside(corners)) {
    const bool is_bounded = (whole_step || step) && detail.triangles_at(detail.coarsest) > most;
    return {is_bounded && !detail.triangles_of_voxels.empty() ? detail.voxels_with(most, detail.coarsest)
                                                              : detail.coarsest,
            nearest_of(corners_of(all_lower, all_upper, matrix)), false};
  }
  if (!step) return {detail.finest, std::max(0.0, nearest_of(corners)), true};
  return {level_with(detail, std::ilogb(*step), most), nearest_of(corners), true};
}

}  // namespace bsp2::api
