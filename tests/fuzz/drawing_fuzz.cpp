// Plane drawings: SVG if the input begins with '<', else DXF.
#include "bsp2/geometry/support/error.hpp"
#include "builder/polygon.hpp"
#include "fuzz.hpp"
#include "import/imports.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return -1;
  try {
    if (data[0] == '<') {
      const auto drawings = bsp2::model::import_svg(bsp2::fuzzing::file_of(data, size, ".svg"), 72, false);
      for (const auto& drawing : *drawings) bsp2::model::convex_pieces(drawing.points, drawing.paths);
    } else {
      const auto drawing = bsp2::model::import_dxf(bsp2::fuzzing::file_of(data, size, ".dxf"), "", {}, {});
      bsp2::model::convex_pieces(drawing.points, drawing.paths);
    }
  } catch (const bsp2::Error&) {
  }
  return 0;
}
