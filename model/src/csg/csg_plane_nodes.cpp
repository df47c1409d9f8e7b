#include <algorithm>
#include <cmath>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "builder/polygon.hpp"
#include "csg/csg_primitive_nodes.hpp"
#include "drawing/text.hpp"

namespace bsp2::model {
namespace {

/// The paths of a polygon; all points in their order if there are none.
void read_paths(const Value* list, std::size_t points, FaceCycles& paths, const Warn& warn) {
  if (!list || list->kind != Value::vector || list->size == 0) {
    for (std::uint32_t i = 0; i < points; ++i) paths.corners.push_back(i);
    paths.end_face();
    return;
  }
  const Value* path = list + 1;
  std::size_t missing = 0;
  std::uint32_t first_with_missing = 0;
  for (std::uint32_t p = 0; p < list->size; path += path->span, ++p) {
    if (path->kind != Value::vector) continue;
    for (const Value* index = path + 1; index != path + path->span; index += index->span) {
      const double x = index->kind == Value::number ? index->as_number : -1;
      if (x >= 0 && x < static_cast<double>(points))
        paths.corners.push_back(static_cast<std::uint32_t>(x));
      else if (missing++ == 0)
        first_with_missing = p;
    }
    paths.end_face();
  }
  if (missing > 0)
    warn("path " + std::to_string(first_with_missing) + " of this polygon names a point that is not there; " +
         counted(points, "there [is|are] #") +
         (missing > 1 ? counted(missing, "; in all, # name[s] of points [is|are] passed over") : ""));
}

}  // namespace

Expression pooled_polygon(const std::vector<std::array<double, 2>>& points, const FaceCycles& paths,
                          NodePool& pool) {
  PolygonPieces polygon = convex_pieces(points, paths);
  std::vector<Expression> pieces;
  for (ConvexPolygon& piece : polygon.pieces) pieces.push_back(pool.primitive(std::move(piece), 2));
  return pool.boolean(polygon.disjoint ? Operation::unite : Operation::symmetric_difference, 2, pieces, true);
}

Expression make_square(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  double x = 1, y = 1;
  if (const Value* size = arguments.find("size", 0)) {
    if (size->kind == Value::number) {
      x = y = size->as_number;
    } else if (size->kind == Value::vector && size->size == 2 && size->span == 3 &&
               size[1].kind == Value::number && size[2].kind == Value::number) {
      x = size[1].as_number;
      y = size[2].as_number;
    } else if (size->kind != Value::undefined) {
      warn(
          "the size of this square is neither a number nor a vector of two numbers; it is taken to be [1, "
          "1]");
    }
  }
  if (!finite({x, y}) || x <= 0 || y <= 0) {
    if (!(x == 0 || y == 0))
      warn("this square is empty: its size is [" + text_of(x) + ", " + text_of(y) + "]");
    return pool.empty(2);
  }
  const Expression square = pool.primitive(Cuboid{{x, y}}, 2);
  if (!arguments.flag("center", 1)) return square;
  return pool.transform({1, 0, -x / 2, 0, 1, -y / 2, 0, 0, 1}, square);
}

Expression make_circle(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const double radius = radius_of(arguments, "r", "d", 0, 1);
  if (!std::isfinite(radius) || radius <= 0) {
    if (radius != 0) warn("this circle is empty: its radius is " + text_of(radius));
    return pool.empty(2);
  }
  if (options.curved && !is_polygon(radius, arguments))
    return pool.primitive(Round{radius, radius, {}, sides_in_place(radius, arguments)}, 2);
  return pool.primitive(RegularPolygon{checked_sides(radius, arguments, false), radius}, 2);
}

Expression make_polygon(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const Value* list = arguments.find("points", 0);
  std::vector<Point3> points;
  if (!list || list->kind != Value::vector || !read_points(list, 2, points)) {
    warn("this polygon is empty: it has no points, or one that is not two finite numbers");
    return pool.empty(2);
  }
  std::vector<std::array<double, 2>> plane;
  for (const Point3& point : points) plane.push_back({point[0], point[1]});
  FaceCycles paths;
  read_paths(arguments.find("paths", 1), plane.size(), paths, warn);
  return pooled_polygon(plane, paths, pool);
}

Expression make_text(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  TextStyle style;
  style.size = arguments.number("size", 1, 10);
  style.spacing = arguments.number("spacing", -1, 1);
  style.font = arguments.string("font", 2, "");
  style.direction = arguments.string("direction", -1, "ltr");
  style.language = arguments.string("language", -1, "en");
  style.script = arguments.string("script", -1, "");
  style.horizontal = arguments.string("halign", -1, "left");
  style.vertical = arguments.string("valign", -1, "baseline");
  if (!finite({style.size, style.spacing})) throw Error("text: size or spacing is not finite");
  // Curves of letters are short: an eighth of the segments of a circle of the text's size.
  style.segments = static_cast<std::uint32_t>(
      std::max(std::floor(checked_sides(style.size, arguments, false) / 8.0) + 1, 2.0));
  const TextOutlines outlines = text_outlines(arguments.string("text", 0, ""), style, warn);
  std::vector<Expression> glyphs, letters;
  for (const GlyphOutline& glyph : outlines.glyphs) {
    FaceCycles paths;
    for (std::uint32_t i = 0, end = 0; const std::uint32_t length : glyph.path_lengths) {
      for (end = i + length; i < end; ++i) paths.corners.push_back(i);
      paths.end_face();
    }
    glyphs.push_back(pooled_polygon(glyph.points, paths, pool));
  }
  for (const auto& [glyph, at] : outlines.placed)
    letters.push_back(pool.transform({1, 0, at[0], 0, 1, at[1], 0, 0, 1}, glyphs[glyph]));
  return pool.boolean(Operation::unite, 2, letters, true);
}

}  // namespace bsp2::model
