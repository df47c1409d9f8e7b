#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "bsp2/geometry/surface/outline.hpp"
#include "bsp2/io/outputs/surface.hpp"

namespace bsp2::io {

/// Writes the outlines of a plane solid in millimetres, in the format that the file's ending names
/// (SurfaceFormat::is_plane): a layer a part, called like it and of its colour; areas by even-odd, so holes
/// are holes.
/// @return notes: what is as it should be, but may surprise.
/// @throws bsp2::Error if it cannot be written, its ending is another one, or the solid is empty.
[[nodiscard]] std::vector<std::string> write_outline(const std::filesystem::path& path,
                                                     std::span<const geometry::PartOutline> outlines,
                                                     const SurfaceParts& parts = {});

}  // namespace bsp2::io
