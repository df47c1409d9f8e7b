#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/geometry/surface/round_solid.hpp"
#include "bsp2/io/outputs/surface.hpp"

namespace bsp2::io {

/// Writes the faces of a solid for CAD programs, in the format that the file's ending names
/// (SurfaceFormat::has_faces): STEP AP242 and IGES hold plane faces with holes, sewn into closed shells with
/// cavities, in millimetres, with names and colours; .brep, Open CASCADE's own, the shapes alone.
///
/// One product a part, called like it; each of its pieces is a solid. Solids have faces, edges and vertices
/// of their own also where they touch, as these programs want it: an edge has two faces. What they take for
/// points, edges shorter than 1e-7, are points. The file appears under its name when it is complete.
/// @param rounds solids that stand free: each takes the place of what the complex has in its box, and is
/// written with its true surface, a sphere, cylinder, cone or torus.
/// @return notes: what is as it should be, but may surprise.
/// @throws bsp2::Error if it cannot be written, its ending is another one, or Open CASCADE's module cannot be
/// loaded.
[[nodiscard]] std::vector<std::string> write_cad(const std::filesystem::path& path,
                                                 const geometry::Brep& brep, const SurfaceParts& parts = {},
                                                 std::span<const geometry::RoundSolid> rounds = {});

}  // namespace bsp2::io
