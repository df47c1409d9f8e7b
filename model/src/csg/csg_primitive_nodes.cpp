#include "csg/csg_primitive_nodes.hpp"

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"

namespace bsp2::model {
namespace {

std::string sides_text(double sides, double radius, const Resolution& resolution) {
  return text_of(sides) + " sides asked for ($fn = " + text_of(resolution.fn) +
         ", $fa = " + text_of(resolution.fa) + ", $fs = " + text_of(resolution.fs) + ", radius " +
         text_of(radius) + ")";
}

}  // namespace

std::uint32_t checked_sides(double radius, const Arguments& arguments, bool is_sphere) {
  const Resolution resolution = resolution_of(arguments);
  const double sides = side_count(radius, resolution);
  if (!(sides <= max_sides))
    throw Error(sides_text(sides, radius, resolution) + "; the limit is " + std::to_string(max_sides));
  const auto count = static_cast<std::uint32_t>(sides);
  if (is_sphere && std::uint64_t{count} * ring_count(count) > max_sphere_facets)
    throw Error(sides_text(sides, radius, resolution) + " in " +
                counted(ring_count(count), "# ring[s]; the limit is ") + std::to_string(max_sphere_facets) +
                " facets");
  return count;
}

double radius_of(const Arguments& arguments, std::string_view radius, std::string_view diameter, int place,
                 double missing) {
  if (const Value* value = arguments.find(diameter); value && value->kind == Value::number)
    return value->as_number / 2;
  return arguments.number(radius, place, missing);
}

std::uint32_t sides_in_place(double radius, const Arguments& arguments) {
  return static_cast<std::uint32_t>(std::clamp(side_count(radius, resolution_of(arguments)), 3.0, 1000.0));
}

bool is_polygon(double radius, const Arguments& arguments) {
  const double fn = resolution_of(arguments).fn;
  return fn > 0 && side_count(radius, {.fn = fn}) <= 6;
}

bool read_points(const Value* list, std::uint32_t largest, std::vector<Point3>& points) {
  points.reserve(list->size);
  const Value* at = list + 1;
  for (std::uint32_t i = 0; i < list->size; at += at->span, ++i) {
    if (at->kind != Value::vector || at->size < 2 || at->size > largest || at->span != at->size + 1)
      return false;
    Point3 point{};
    for (std::uint32_t k = 0; k < at->size; ++k) {
      if (at[k + 1].kind != Value::number || !std::isfinite(at[k + 1].as_number)) return false;
      point[k] = at[k + 1].as_number;
    }
    points.push_back(point);
  }
  return true;
}

}  // namespace bsp2::model
