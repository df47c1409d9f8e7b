#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "import/reader_process.hpp"
#include "mesh/mesh_crossing.hpp"

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

using Importer = ImportedParts (*)(const std::filesystem::path&, const Fineness&);

/// By ending.
constexpr std::pair<std::string_view, Importer> importers[] = {{".3mf", import_many<import_3mf>},
                                                               {".amf", import_one<import_amf>},
                                                               {".brep", import_cad},
                                                               {".glb", import_many<import_gltf>},
                                                               {".gltf", import_many<import_gltf>},
                                                               {".iges", import_cad},
                                                               {".igs", import_cad},
                                                               {".obj", import_one<import_obj>},
                                                               {".off", import_one<import_off>},
                                                               {".ply", import_one<import_ply>},
                                                               {".step", import_cad},
                                                               {".stl", import_one<import_stl>},
                                                               {".stp", import_cad}};

Importer importer_of(std::string_view ending) {
  for (const auto& [known, importer] : importers)
    if (known == ending) return importer;
  return nullptr;
}

/// How a part is called in messages; the whole if it has no name.
std::string mesh_name(const std::filesystem::path& path, const std::string& part) {
  return "the mesh of " + (part.empty() ? "" : "'" + part + "' in ") + path.string();
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

std::string mesh_endings() {
  std::string text;
  for (const auto& importer : importers)
    text += (&importer == importers                 ? ""
             : &importer + 1 == std::end(importers) ? " and "
                                                    : ", ") +
            std::string(importer.first);
  return text;
}

ImportedParts import_parts(const std::filesystem::path& path, const Fineness& fineness) {
  if (!std::filesystem::is_regular_file(path)) throw Error("import: there is no file " + path.string());
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
  const ImportedParts read = import_parts(path, fineness);
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
  if (solids.empty())
    call(remarks.warn, "this import is empty: the faces of " + path.string() + " enclose nothing");
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
