#include "csg/csg_construct_nodes.hpp"

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/error.hpp"
#include "csg/csg_primitive_nodes.hpp"

namespace bsp2::model {

std::optional<Construct> read_hull(const Arguments&, const Warn&) { return Hull{}; }
std::optional<Construct> read_minkowski(const Arguments&, const Warn&) { return MinkowskiSum{}; }
std::optional<Construct> read_fill(const Arguments&, const Warn&) { return Fill{}; }

std::optional<Construct> read_projection(const Arguments& arguments, const Warn&) {
  return Projection{arguments.flag("cut", 0)};
}

std::optional<Construct> read_linear_extrude(const Arguments& arguments, const Warn& warn) {
  LinearExtrusion extrusion;
  const Value* height = arguments.find("height", 0);
  if (!height) height = arguments.find("h");
  const double length = height && height->kind == Value::number ? height->as_number : 100;
  extrusion.direction = {0, 0, length};
  bool has_no_direction = false;
  if (const Value* v = arguments.find("v"); v && v->kind == Value::vector) {
    std::array<double, 3> direction{};
    read_numbers(v, direction);
    const double norm = std::hypot(direction[0], direction[1], direction[2]);
    has_no_direction = norm == 0;
    for (int i = 0; i < 3; ++i)
      extrusion.direction[i] = height ? direction[i] * (length / norm) : direction[i];
  }
  extrusion.center = arguments.flag("center", -1);
  extrusion.twist = arguments.number("twist", -1, 0);
  if (!std::isfinite(extrusion.twist)) extrusion.twist = 0;
  read_numbers(arguments.find("scale"), extrusion.scale);
  for (double& scale : extrusion.scale) scale = std::isfinite(scale) ? std::max(scale, 0.0) : 1;
  const double slices = arguments.number("slices", -1, 0);
  if (slices > max_sides)
    throw Error(text_of(slices) + " slices asked for; the limit is " + std::to_string(max_sides));
  extrusion.slices = slices >= 1 ? static_cast<std::uint32_t>(slices) : 0;
  extrusion.resolution = resolution_of(arguments);
  const auto& d = extrusion.direction;
  if (!finite({d[0], d[1], d[2]}) || d[2] <= 0) {
    if (has_no_direction)
      warn("this linear_extrude is empty: its v is [0, 0, 0]");
    else if (d[2] != 0)
      warn("this linear_extrude is empty: its height is " + text_of(d[2]));
    return std::nullopt;
  }
  return extrusion;
}

std::optional<Construct> read_rotate_extrude(const Arguments& arguments, const Warn& warn) {
  RotateExtrusion extrusion;
  extrusion.angle = arguments.number("angle", -1, 360);
  if (!(extrusion.angle > -360 && extrusion.angle <= 360)) extrusion.angle = 360;
  extrusion.start = arguments.number("start", -1, extrusion.angle == 360 ? 180 : 0);
  if (!std::isfinite(extrusion.start)) extrusion.start = 0;
  extrusion.resolution = resolution_of(arguments);
  if (extrusion.angle != 0) return extrusion;
  warn("this rotate_extrude is empty: its angle is 0");
  return std::nullopt;
}

std::optional<Construct> read_offset(const Arguments& arguments, const Warn&) {
  Offset offset{.distance = 1};  // if no number says another
  offset.resolution = resolution_of(arguments);
  if (const Value* r = arguments.find("r", 0); r && r->kind == Value::number) {
    offset.distance = r->as_number;
  } else if (const Value* delta = arguments.find("delta", -1); delta && delta->kind == Value::number) {
    offset.distance = delta->as_number;
    offset.join = arguments.flag("chamfer", -1) ? Offset::Join::square : Offset::Join::mitre;
  }
  if (!std::isfinite(offset.distance)) throw Error("offset: the distance is not finite");
  if (offset.join == Offset::Join::round) checked_sides(std::fabs(offset.distance), arguments, false);
  return offset;
}

std::optional<Construct> read_roof(const Arguments& arguments, const Warn& warn) {
  Roof roof;
  roof.resolution = resolution_of(arguments);
  const std::string method = arguments.string("method", 0, "voronoi");
  if (method == "straight")
    roof.method = Roof::Method::straight;
  else if (method != "voronoi")
    warn("roof has no method '" + method.substr(0, 60) + "'; voronoi is taken");
  return roof;
}

std::optional<Construct> read_resize(const Arguments& arguments, const Warn&) {
  Resize resize;
  read_numbers(arguments.find("newsize", 0), resize.size);
  std::array<double, 3> automatic{};
  read_numbers(arguments.find("auto", 1), automatic);
  if (const Value* value = arguments.find("auto", 1); value && value->kind == Value::boolean)
    automatic.fill(value->as_number);
  for (int i = 0; i < 3; ++i) {
    resize.automatic[i] = automatic[i] != 0;
    if (!std::isfinite(resize.size[i])) resize.size[i] = 0;
  }
  return resize;
}

}  // namespace bsp2::model
