#include "bsp2/io/outputs/outline.hpp"

#include <algorithm>
#include <limits>
#include <sstream>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "surfaces/labels.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

/// The points of a path that go farthest: its corners, and of arcs the ends across the axes.
template <typename Use>
void for_each_end(const geometry::OutlinePath& path, const Use& use) {
  for (std::size_t i = 0; i < path.corners.size(); ++i) {
    const Sheet::Point &from = path.corners[i], &to = path.corners[(i + 1) % path.corners.size()];
    use(from);
    const double bulge = path.bulges.empty() ? 0 : path.bulges[i];
    if (bulge == 0) continue;
    const geometry::OutlineArc arc(from, to, bulge);
    for (const int axis : {0, 1})
      for (const double radius : {-arc.radius, arc.radius}) {
        Sheet::Point end = arc.centre;
        end[axis] += radius;
        const double side = (to[0] - from[0]) * (end[1] - from[1]) - (to[1] - from[1]) * (end[0] - from[0]);
        if ((side < 0) == (bulge > 0)) use(end);
      }
  }
}

/// What holds all paths.
void set_page(Sheet& sheet) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  sheet.lower = {infinity, infinity};
  sheet.upper = {-infinity, -infinity};
  for (const Sheet::Area& area : sheet.areas)
    for (const auto& path : area.loops)
      for_each_end(path, [&](const Sheet::Point& point) {
        for (const int axis : {0, 1}) {
          sheet.lower[axis] = std::min(sheet.lower[axis], point[axis]);
          sheet.upper[axis] = std::max(sheet.upper[axis], point[axis]);
        }
      });
}

/// A part without a colour is drawn as OpenSCAD draws all.
constexpr SurfaceParts::Colour light_grey{211, 211, 211, 255};

Sheet sheet_of(std::span<const geometry::PartOutline> outlines, const PartLabels& labels) {
  Sheet sheet;
  sheet.title = one_line(labels.whole());
  for (const geometry::PartOutline& outline : outlines) {
    if (outline.paths.empty()) continue;
    const auto colour = labels.colour(outline.part).value_or(light_grey);
    const Sheet::Rgb rgb{colour[0], colour[1], colour[2]};
    const auto layer = static_cast<std::uint32_t>(sheet.layers.size());
    sheet.layers.push_back({labels.name(outline.part), rgb, 0.25, {}});
    sheet.areas.push_back({layer, rgb, colour[3] / 255.0, outline.paths});
  }
  return sheet;
}

/// How much of what is curved is exact.
std::vector<std::string> notes_of_arcs(const fs::path& path,
                                       std::span<const geometry::PartOutline> outlines) {
  std::uint64_t arcs = 0, polygons = 0;
  for (const geometry::PartOutline& outline : outlines) arcs += outline.arcs, polygons += outline.polygons;
  if (arcs + polygons == 0) return {};
  std::string note = path.string() + ": ";
  if (arcs > 0) note += counted(arcs, "# arc[s] of circles, as in the model") + (polygons > 0 ? "; " : "");
  if (polygons > 0)
    note +=
        counted(polygons,
                "# curved piece[s] [is a polygon as the cells have it|are polygons as the cells have them]") +
        ", since only circles become arcs, where it is certain how they end";
  return {note};
}

}  // namespace

std::vector<std::string> write_outline(const fs::path& path, std::span<const geometry::PartOutline> outlines,
                                       const SurfaceParts& parts) {
  check_surface_file(path);
  if (!surface_format(path)->is_plane)
    throw Error("cannot write '" + path.string() +
                "': the model is plane, and the outlines of plane models are " + "written as " +
                plane_endings());
  const SheetFormat format = sheet_format(path).value();
  Sheet sheet = sheet_of(outlines, PartLabels(parts, path.stem().string()));
  if (sheet.areas.empty()) throw Error("cannot write '" + path.string() + "': the plane solid is empty");
  set_page(sheet);
  write_file(path, sheet_bytes(sheet, format));
  std::vector<std::string> notes = notes_of_arcs(path, outlines);
  if (format != SheetFormat::dxf && sheet.lower != Sheet::Point{0, 0}) {
    std::ostringstream note;
    note
        << path.string() << ": the page begins at the lower left corner of the outline, which is at ("
        << sheet.lower[0] << ", " << sheet.lower[1]
        << ") in the model and will be at the origin where the file is imported; a .dxf keeps coordinates as "
           "they are";
    notes.push_back(note.str());
  }
  return notes;
}

}  // namespace bsp2::io
