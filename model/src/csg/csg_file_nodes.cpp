#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "builder/polyhedron.hpp"
#include "csg/csg_primitive_nodes.hpp"
#include "import/imports.hpp"

namespace bsp2::model {
namespace {

/// The file that a node names.
std::filesystem::path file_of(const std::string& node, const Arguments& arguments,
                              const std::filesystem::path& folder) {
  const std::string name = arguments.string("file", 0, "");
  if (name.empty()) throw Error(node + ": it names no file");
  const std::filesystem::path path = folder / name;
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  if (type == std::filesystem::file_type::directory)
    throw Error(node + ": " + path.string() + " is a directory, not a file");
  if (type == std::filesystem::file_type::none)
    throw Error(node + ": " + path.string() + " cannot be read: " + error.message());
  if (type == std::filesystem::file_type::not_found)
    throw Error(node + ": there is no file " + path.string() +
                (name.find('\\') == std::string::npos
                     ? ""
                     : "; here it is '/' that stands between the names of folders"));
  if (type != std::filesystem::file_type::regular)
    throw Error(node + ": " + path.string() +
                " is a pipe or a device; save what it tells as a file and name that");
  return path;
}

/// The scale of a linear_extrude that names a file is that of the drawing, too.
DrawingFrame read_frame(const Arguments& arguments) {
  DrawingFrame frame;
  std::array<double, 2> scale{1, 1};
  read_numbers(arguments.find("origin"), frame.origin);
  read_numbers(arguments.find("scale"), scale);
  frame.scale = scale[0] > 0 ? scale[0] : 1;
  return frame;
}

/// How finely faces become triangles. The deflection is a length, as of the model.
Fineness read_fineness(const Arguments& arguments) {
  const double deflection = arguments.number("deflection", -1, 0);
  if (arguments.find("deflection") != nullptr && !(deflection > 0 && deflection <= largest_coordinate))
    throw Error("import: the deflection has to be a length above 0");
  return {resolution_of(arguments), deflection};
}

/// One part of the source, whatever the parts of the file are called.
Expression pooled_solids(std::vector<SolidPart> parts, NodePool& pool) {
  std::vector<Expression> solids;
  for (SolidPart& part : parts) {
    Expression solid = pool.primitive(std::move(part.mesh), 3);
    if (part.colour) solid = pool.coloured(*part.colour, solid);
    if (!part.name.empty()) solid = pool.named(Named::Role::part, part.name, solid);
    solids.push_back(std::move(solid));
  }
  if (solids.empty()) return pool.empty(3);
  return solids.size() == 1 ? solids.front() : pool.boolean(Operation::unite, 3, solids, true);
}

}  // namespace

Expression make_import(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const std::filesystem::path path = file_of("import", arguments, folder);
  const std::string kind = lower_ending(path);
  if (kind == ".dxf") {
    const std::string layer = arguments.string("layer", -1, "");
    const PlaneDrawing drawing =
        import_dxf(path, layer, read_frame(arguments), resolution_of(arguments), {warn, note});
    if (drawing.paths.size() == 0)
      warn("this import is empty: there is no path " + (layer.empty() ? "" : "on a layer '" + layer + "' ") +
           "in " + path.string());
    return pooled_polygon(drawing.points, drawing.paths, pool);
  }
  if (kind == ".svg") {
    std::vector<Expression> shapes;
    const SvgSelection selection{arguments.string("id", -1, ""), arguments.string("layer", -1, "")};
    const auto drawings = import_svg(path, arguments.number("dpi", -1, 72), arguments.flag("center", -1),
                                     selection, {warn, note});
    if (!drawings) {
      warn("this import is empty: there is no " + selection.text() + " in " + path.string());
      return pool.empty(2);
    }
    for (const PlaneDrawing& drawing : *drawings)
      shapes.push_back(pooled_polygon(drawing.points, drawing.paths, pool));
    return pool.boolean(Operation::unite, 2, shapes, true);
  }
  if (!is_mesh_ending(kind)) throw Error("import: " + why_not_read(kind));
  return pooled_solids(solids_of_file(path, read_fineness(arguments), {warn, note}), pool);
}

Expression make_surface(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const auto [mesh, unit] = import_surface(file_of("surface", arguments, folder), arguments.flag("center", 1),
                                           arguments.flag("invert", 2));
  if (std::optional<TriangleMesh> closed = closed_mesh(mesh.points, mesh.faces)) {
    const Expression solid = pool.primitive(std::move(*closed), 3);
    if (unit == 1) return solid;
    return pool.transform({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, unit, 0, 0, 0, 0, 1}, solid);
  }
  warn("this surface is empty: it takes two rows and two columns of heights");
  return pool.empty(3);
}

}  // namespace bsp2::model
