#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/io/outputs/surface.hpp"

namespace bsp2::io {

/// Writes the faces of a solid for CAD programs, in the format that the file's ending names
/// (SurfaceFormat::has_faces):
///   .step, .stp  STEP AP242: plane faces with holes, sewn into closed shells with cavities; names and
///   colours .igs, .iges  IGES: the same as manifold solids (entity 186) .brep        Open CASCADE's own: the
///   shapes alone, with all digits
/// One product a part, called like it; of its pieces each is a solid. Solids have faces, edges and vertices
/// of their own also where they touch, as these programs want it: an edge has two faces. Units are
/// millimetres. The file appears under its name when it is complete.
/// @return notes: what is as it should be, but may surprise.
/// @throws bsp2::Error if it cannot be written, its ending is another one, or Open CASCADE's module cannot be
/// loaded.
[[nodiscard]] std::vector<std::string> write_cad(const std::filesystem::path& path,
                                                 const geometry::Brep& brep, const SurfaceParts& parts = {});

}  // namespace bsp2::io
