// Mesh and landscape files: the first byte of the input says of which kind it is.
#include <array>

#include "bsp2/geometry/support/error.hpp"
#include "builder/polyhedron.hpp"
#include "fuzz.hpp"
#include "import/imports.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr std::array endings{".stl", ".off", ".obj", ".ply", ".dat", ".3mf", ".amf"};
  if (size == 0) return -1;
  const char* ending = endings[data[0] % endings.size()];
  const auto path = bsp2::fuzzing::file_of(data + 1, size - 1, ending);
  try {
    if (std::string_view(ending) == ".dat") {
      const auto mesh = bsp2::model::import_surface(path, false, false).mesh;
      bsp2::model::closed_mesh(mesh.points, mesh.faces);
    } else {
      const auto mesh = bsp2::model::import_mesh(path);
      bsp2::model::repaired_mesh(mesh.points, mesh.faces, bsp2::model::Holes::cap, [](const std::string&) {});
    }
  } catch (const bsp2::Error&) {
  }
  return 0;
}
