#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "import/part_names.hpp"
#include "import/reader_process.hpp"
#include "mesh/mesh_crossing.hpp"
#include "mesh/mesh_touching.hpp"

namespace bsp2::model {
namespace {

ImportedParts as_part(ImportedMesh mesh) {
  ImportedParts result;
  result.warnings = std::move(mesh.warnings);
  result.parts.push_back({{}, {}, std::move(mesh)});
  return result;
}

template <ImportedMesh (*read)(std::string_view, const std::filesystem::path&)>
ImportedParts import_one(const std::filesystem::path& path, const Fineness&) {
  return as_part(read(read_text(path), path));
}

template <ImportedParts (*read)(std::string_view, const std::filesystem::path&)>
ImportedParts import_many(const std::filesystem::path& path, const Fineness&) {
  return read(read_text(path), path);
}

ImportedParts import_cad(const std::filesystem::path& path, const Fineness& fineness) {
  return parts_by_program("bsp2-read-cad", "Open CASCADE", path, fineness);
}

ImportedParts import_vtk(const std::filesystem::path& path, const Fineness& fineness) {
  return parts_by_program("bsp2-read-vtk", "VTK", path, fineness);
}

using Importer = ImportedParts (*)(const std::filesystem::path&, const Fineness&);

struct ImportFormat {
  std::string_view ending;
  Importer import;
  bool has_parts, has_colours;
  std::string_view description;
};

constexpr bool with_parts = true, no_parts = false, with_colours = true, no_colours = false;

/// By ending: the one place that knows them.
constexpr ImportFormat formats[] = {
    {".3mf", import_many<import_3mf>, with_parts, with_colours, "objects of the build"},
    {".amf", import_many<import_amf>, no_parts, no_colours, "all objects as one mesh"},
    {".brep", import_cad, with_parts, no_colours, "faces of Open CASCADE: a part a solid"},
    {".glb", import_many<import_gltf>, with_parts, with_colours, "glTF, binary: a part a node with a mesh"},
    {".gltf", import_many<import_gltf>, with_parts, with_colours, "the same as text"},
    {".iges", import_cad, with_parts, with_colours, "faces of CAD programs"},
    {".igs", import_cad, with_parts, with_colours, "the same"},
    {".msh", import_many<import_msh>, with_parts, no_colours,
     "gmsh 2.2 and 4.1: triangles, or the outside of solids"},
    {".obj", import_one<import_obj>, no_parts, no_colours, "all groups as one mesh"},
    {".off", import_one<import_off>, no_parts, no_colours, "a mesh"},
    {".ply", import_one<import_ply>, no_parts, no_colours, "a mesh"},
    {".step", import_cad, with_parts, with_colours, "faces of CAD programs: a part a product"},
    {".stl", import_one<import_stl>, no_parts, no_colours, "a mesh"},
    {".stp", import_cad, with_parts, with_colours, "the same as .step"},
    {".vtp", import_vtk, with_parts, with_colours, "surfaces of VTK and ParaView"},
};

/// What is read elsewhere, for the table.
constexpr ImportFormat drawings[] = {{".dxf", nullptr, no_parts, no_colours, "plane: closed outlines"},
                                     {".svg", nullptr, no_parts, no_colours, "plane: areas of a drawing"}};

/// What is written for pages and other programs, and is not read.
constexpr std::string_view written_alone[] = {".inp", ".pdf", ".pvtu", ".vtu", ".wrl", ".x3d", ".xdmf"};

Importer importer_of(std::string_view ending) {
  for (const ImportFormat& format : formats)
    if (format.ending == ending) return format.import;
  return nullptr;
}

/// How a part is called in messages; the whole if it has no name.
std::string mesh_name(const std::filesystem::path& path, const std::string& part) {
  return "the mesh of " + (part.empty() ? "" : "'" + part + "' in ") + path.string();
}

/// Parts that bound a solid only together become one, as a surface has nothing between parts that touch.
void join_touching(ImportedParts& read) {
  if (read.parts.size() < 2) return;
  std::vector<MeshView> meshes;
  for (const ImportedPart& part : read.parts) meshes.push_back({part.mesh.points, part.mesh.faces});
  const auto groups = closed_together(meshes);
  if (groups.size() == read.parts.size()) return;
  std::vector<ImportedPart> parts;
  for (const std::vector<std::size_t>& group : groups) {
    ImportedPart part = std::move(read.parts[group.front()]);
    std::string names = "'" + part.name + "'";
    std::vector<ImportedPart> touching;
    for (std::size_t i = 1; i < group.size(); ++i) {
      const ImportedPart& other = read.parts[group[i]];
      part.name += other.name.empty() ? "" : (part.name.empty() ? "" : " + ") + other.name;
      names += (i + 1 == group.size() ? " and '" : ", '") + other.name + "'";
      if (other.colour != part.colour) part.colour.reset();
    }
    if (group.size() > 1) {
      for (const std::size_t i : group)
        touching.push_back({{}, {}, i == group.front() ? part.mesh : std::move(read.parts[i].mesh)});
      part.mesh = joined(touching);
      part.name = printable_name(part.name);
      read.notes.push_back(
          "the parts " + names +
          " touch each other, and the file has nothing between them: they are one part here" +
          (part.name.empty() ? "" : ", '" + part.name + "'"));
    }
    parts.push_back(std::move(part));
  }
  read.parts = std::move(parts);
}

void call(const std::function<void(const std::string&)>& told, const std::string& text) {
  if (told) told(text);
}

Expression named_solid(const SolidPart& part, Expression solid) {
  if (part.colour) solid = colour(*part.colour, std::move(solid));
  return part.name.empty() ? solid : bsp2::model::part(part.name, std::move(solid));
}

}  // namespace

std::uint32_t ImportedMesh::add_point(const Point3& point) {
  if (points.size() == 0xFFFFFFFFu) throw Error("a mesh of more than 2^32 points");
  points.push_back(point);
  return static_cast<std::uint32_t>(points.size() - 1);
}

void ImportedMesh::add_face(std::span<const std::uint32_t> corners) {
  faces.corners.insert(faces.corners.end(), corners.rbegin(), corners.rend());
  faces.end_face();
}

std::vector<std::string> notes_of_unit(std::string_view unit) {
  struct Unit {
    std::string_view name, told, millimetres;
  };
  constexpr std::array<Unit, 7> units{{{"micron", "micrometres", "0.001"},
                                       {"centimeter", "centimetres", "10"},
                                       {"meter", "metres", "1000"},
                                       {"inch", "inches", "25.4"},
                                       {"feet", "feet", "304.8"},
                                       {"foot", "feet", "304.8"},
                                       {"millimeter", "", ""}}};
  const auto* known = std::ranges::find(units, unit, &Unit::name);
  if (known == units.end())
    return {"its unit '" + std::string(unit) + "' is none that is known; nothing is scaled"};
  if (known->told.empty()) return {};
  return {"it is in " + std::string(known->told) +
          "; nothing is scaled, one of them is one unit of the model, and scale(" +
          std::string(known->millimetres) + ") makes millimetres of them"};
}

ImportedMesh joined(const std::vector<ImportedPart>& parts) {
  if (parts.size() == 1) return parts.front().mesh;
  ImportedMesh all;
  for (const ImportedPart& part : parts) {
    const auto first = static_cast<std::uint32_t>(all.points.size());
    for (const Point3& point : part.mesh.points) all.add_point(point);
    const std::size_t corners = all.faces.corners.size();
    for (const std::uint32_t corner : part.mesh.faces.corners) all.faces.corners.push_back(first + corner);
    for (const std::size_t end : part.mesh.faces.ends) all.faces.ends.push_back(corners + end);
  }
  return all;
}

bool is_mesh_ending(std::string_view ending) { return importer_of(ending) != nullptr; }

bool is_written_alone(std::string_view ending) {
  return std::find(std::begin(written_alone), std::end(written_alone), ending) != std::end(written_alone);
}

std::string why_not_read(std::string_view ending) {
  return "files named *" + std::string(ending) +
         (is_written_alone(ending) ? " are written, but not read; " : " are not read; ") + mesh_endings() +
         " are, .dxf and .svg";
}

std::string mesh_endings() {
  std::string text;
  for (const ImportFormat& format : formats)
    text += (&format == formats                 ? ""
             : &format + 1 == std::end(formats) ? " and "
                                                : ", ") +
            std::string(format.ending);
  return text;
}

std::string import_format_table() {
  std::vector<ImportFormat> all(std::begin(formats), std::end(formats));
  all.insert(all.end(), std::begin(drawings), std::end(drawings));
  std::sort(all.begin(), all.end(),
            [](const ImportFormat& a, const ImportFormat& b) { return a.ending < b.ending; });
  std::string table = "ending parts  colours  is read as\n";
  const auto cell = [&](std::string_view text, std::size_t width) {
    table += text;
    table.append(width - text.size(), ' ');
  };
  for (const ImportFormat& format : all) {
    cell(format.ending, 7);
    cell(format.has_parts ? "yes" : "-", 7);
    cell(format.has_colours ? "yes" : "-", 9);
    (table += format.description) += '\n';
  }
  return table;
}

ImportedParts import_parts(const std::filesystem::path& path, const Fineness& fineness) {
  std::error_code error;  // a name may be too long for the system
  if (!std::filesystem::is_regular_file(path, error))
    throw Error("import: there is no file " + path.string());
  const std::string ending = lower_ending(path);
  const Importer importer = importer_of(ending);
  if (importer == nullptr) throw Error("import: files named *" + ending + " are no meshes that are read");
  return importer(path, fineness);
}

ImportedMesh import_mesh(const std::filesystem::path& path) {
  const ImportedParts read = import_parts(path);
  ImportedMesh mesh = joined(read.parts);
  mesh.warnings = read.warnings;
  return mesh;
}

std::vector<SolidPart> solids_of_file(const std::filesystem::path& path, const Fineness& fineness,
                                      const Remarks& remarks) {
  ImportedParts read = import_parts(path, fineness);
  join_touching(read);
  for (const std::string& text : read.warnings) call(remarks.warn, path.string() + ": " + text);
  for (const std::string& text : read.notes) call(remarks.note, path.string() + ": " + text);
  std::vector<SolidPart> solids;
  for (const ImportedPart& part : read.parts) {
    const std::string name = mesh_name(path, part.name);
    std::optional<TriangleMesh> closed;
    try {
      closed = repaired_mesh(part.mesh.points, part.mesh.faces, Holes::cap,
                             [&](const std::string& text) { call(remarks.warn, name + " is " + text); });
    } catch (const Error& error) {
      throw Error("import of " + path.string() + ": " +
                  (part.name.empty() ? "" : "part '" + part.name + "': ") + error.what());
    }
    if (closed)
      solids.push_back({part.name, part.colour, std::move(*closed)});
    else if (read.parts.size() > 1)
      call(remarks.warn, name + " encloses nothing and is left out");
  }
  const bool has_faces =
      std::ranges::any_of(read.parts, [](const ImportedPart& part) { return !part.mesh.faces.ends.empty(); });
  if (solids.empty())
    call(remarks.warn,
         "this import is empty: " + (has_faces ? "the faces of " + path.string() + " enclose nothing"
                                               : "there are no faces in " + path.string()));
  return solids;
}

Expression imported(const std::filesystem::path& path, const std::function<void(const std::string&)>& warn) {
  std::vector<Expression> parts;
  for (SolidPart& part : solids_of_file(path, {}, {warn, {}})) {
    if (const auto crossing = warn ? self_crossing(part.mesh) : std::nullopt)
      warn(mesh_name(path, part.name) + " crosses itself: " + text_of(*crossing) +
           ". What its faces wind around counts as inside");
    parts.push_back(
        named_solid(part, Expression(std::make_shared<Node>(3, Primitive(std::move(part.mesh))))));
  }
  if (parts.empty()) return Expression(3);
  return parts.size() == 1 ? parts.front() : unite(std::move(parts));
}

}  // namespace bsp2::model
