#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "mesh/mesh_crossing.hpp"

namespace bsp2::model {
namespace {

using Importer = ImportedMesh (*)(std::string_view, const std::filesystem::path&);

constexpr std::pair<std::string_view, Importer> importers[] = {{".stl", import_stl}, {".off", import_off},
                                                               {".obj", import_obj}, {".ply", import_ply},
                                                               {".3mf", import_3mf}, {".amf", import_amf}};

Importer importer_of(std::string_view ending) {
  for (const auto& [known, importer] : importers)
    if (known == ending) return importer;
  return nullptr;
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

bool is_mesh_ending(std::string_view ending) { return importer_of(ending) != nullptr; }

ImportedMesh import_mesh(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) throw Error("import: there is no file " + path.string());
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const Importer importer = importer_of(ending);
  if (importer == nullptr) throw Error("import: files named *" + ending + " are no meshes that are read");
  return importer(read_text(path), path);
}

std::optional<TriangleMesh> mesh_of_file(const std::filesystem::path& path,
                                         const std::function<void(const std::string&)>& warn) {
  const ImportedMesh mesh = import_mesh(path);
  for (const std::string& text : mesh.warnings) warn(path.string() + ": " + text);
  std::optional<TriangleMesh> closed;
  try {
    closed = repaired_mesh(mesh.points, mesh.faces, Holes::cap, [&](const std::string& text) {
      warn("the mesh of " + path.string() + " is " + text);
    });
  } catch (const Error& error) {
    throw Error("import of " + path.string() + ": " + error.what());
  }
  if (!closed) warn("this import is empty: the faces of " + path.string() + " enclose nothing");
  return closed;
}

Expression imported(const std::filesystem::path& path, const std::function<void(const std::string&)>& warn) {
  std::optional<TriangleMesh> mesh = mesh_of_file(path, [&](const std::string& text) {
    if (warn) warn(text);
  });
  if (!mesh) return Expression(3);
  if (const auto crossing = warn ? self_crossing(*mesh) : std::nullopt)
    warn("the mesh of " + path.string() + " crosses itself: " + text_of(*crossing) +
         ". What its faces wind around counts as inside");
  return Expression(std::make_shared<Node>(3, Primitive(std::move(*mesh))));
}

}  // namespace bsp2::model
