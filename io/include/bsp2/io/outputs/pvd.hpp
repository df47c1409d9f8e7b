#pragma once

#include <filesystem>
#include <span>
#include <utility>

namespace bsp2::io {

/// Writes a ParaView data file: meshes, and the time at which ParaView shows each.
/// @param meshes time and path; paths below the folder of `pvd` are written relative to it, so that all may
/// move together.
/// @throws bsp2::Error if the file cannot be written.
void write_pvd(const std::filesystem::path& pvd,
               std::span<const std::pair<double, std::filesystem::path>> meshes);

}  // namespace bsp2::io
