// Files of other programs that have a reader of our own: what begins like a mesh of gmsh is one, all else is
// glTF. So the seeds are files as they are.
#include <string_view>

#include "bsp2/geometry/support/error.hpp"
#include "builder/polyhedron.hpp"
#include "fuzz.hpp"
#include "import/imports.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const char* ending = bytes.starts_with("$Mesh") ? ".msh" : bytes.starts_with("glTF") ? ".glb" : ".gltf";
  try {
    for (const auto& part : bsp2::model::import_parts(bsp2::fuzzing::file_of(data, size, ending)).parts)
      bsp2::model::repaired_mesh(part.mesh.points, part.mesh.faces, bsp2::model::Holes::cap,
                                 [](const std::string&) {});
  } catch (const bsp2::Error&) {
  }
  return 0;
}
