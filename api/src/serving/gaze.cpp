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

/// A corner of a box, as it is seen.
struct Corner {
  std::array<double, 3> place;
  double depth;
};

std::array<Corner, 8> corners_of(const Detail& detail, const std::array<double, 16>& matrix) {
  std::array<Corner, 8> corners{};
  for (unsigned i = 0; i < 8; ++i) {
    std::array<double, 4> seen{};
    for (unsigned row = 0; row < 4; ++row) {
      seen[row] = matrix[12 + row];
      for (unsigned axis = 0; axis < 3; ++axis)
        seen[row] += matrix[4 * axis + row] * ((i >> axis & 1U) != 0 ? detail.upper : detail.lower)[axis];
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

/// The level of what may have so many triangles.
/// @param seen the one whose step is as small as can be seen.
int level_with(const Detail& detail, int seen, double most, bool has_voxels) {
  const int first = std::clamp(std::min(seen, detail.whole), detail.finest, detail.coarsest);
  constexpr int most_levels = 1;  // above that of half a pixel: a pixel
  int level = first;
  while (level < std::min(seen + most_levels, detail.whole) && detail.triangles_at(level) > most) ++level;
  if (detail.triangles_at(level) <= most || !has_voxels || detail.triangles_of_voxels.empty()) return level;
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
  gaze.depth = std::max(0.0, number_in(said, "depth").value_or(0));
  gaze.sees_all = flag_in(said, "all");
  gaze.wants_surface = flag_in(said, "surface");
  for (const json& part : list_in(said, "hidden"))
    if (part.is_number_integer()) gaze.hidden.insert(part.get<std::int32_t>());
  for (const auto& [name, kind] :
       {std::pair{"pieces", Detail::Kind::surface}, {"regions", Detail::Kind::cells}})
    for (const json& each : list_in(said, name))
      if (each.is_number_unsigned()) gaze.exactly.emplace(kind, each.get<std::uint32_t>());
  return gaze;
}

Gaze::Wanted Gaze::wanted(const Detail& detail, std::uint64_t run_of_surface) const {
  constexpr double steps_of_a_pixel = 2, triangles_of_a_pixel = 2, most_aspect = 100;
  constexpr double least_triangles = 24;  // a box of what is IN, and one of what is FUZZY
  const bool shows_surface = wants_surface && detail.run == run_of_surface;
  if ((detail.kind == Detail::Kind::surface) != shows_surface || hidden.contains(detail.part))
    return {Detail::nothing, 0, false};
  if (exactly.contains({detail.kind, detail.number})) return {detail.finest, 0, true};
  const auto corners = corners_of(detail, matrix);
  double nearest = depth;
  if (nearest == 0)
    nearest = std::min_element(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
                return a.depth < b.depth;
              })->depth;
  if (!sees_all && are_outside(corners)) return {detail.coarsest, nearest, false};
  if (!(nearest > 0)) return {detail.finest, 0, true};  // also where products were too large for numbers
  const double growth = std::hypot(matrix[1], matrix[5], matrix[9]);  // of what is upright, at depth 1
  const double step = 2 * nearest / (growth * std::max(1.0, height)) / steps_of_a_pixel;
  if (!std::isfinite(step) || !(step > 0)) return {detail.finest, nearest, true};
  const int seen = std::ilogb(step);
  if (depth > 0) return {std::clamp(seen, detail.finest, detail.coarsest), nearest, true};
  const double across = std::hypot(matrix[0], matrix[4], matrix[8]), half_height = height / 2;
  const double half_width = half_height * growth / std::max(across, growth / most_aspect);
  const double most =
      std::max(least_triangles, triangles_of_a_pixel * area_of(corners, half_width, half_height));
  const bool has_voxels = detail.kind == Detail::Kind::surface || hidden.empty();
  return {level_with(detail, seen, most, has_voxels), nearest, true};
}

}  // namespace bsp2::api
