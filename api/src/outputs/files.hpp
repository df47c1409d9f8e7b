#pragma once

#include <filesystem>
#include <vector>

#include "outputs/outputs.hpp"

namespace bsp2::api {

/// Those with a name of their own, without snapshots.
std::vector<std::filesystem::path> files_of(const Writing& writing);

/// Could they be written? Asked before a long run. @throws bsp2::Error if not.
void check_files(const Writing& writing);

/// Those that a run has written, for the user to find; of a mesh and of a series the one to open.
std::vector<std::filesystem::path> written_files(const Writing& writing, const supersteps::RunReport& report);

}  // namespace bsp2::api
