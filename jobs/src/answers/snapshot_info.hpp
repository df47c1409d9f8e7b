#pragma once

#include <filesystem>
#include <iosfwd>

namespace bsp2::jobs {

/// What a snapshot holds, for people: at most 80 columns but for the names. @throws bsp2::Error if it cannot
/// be read.
void print_snapshot(std::ostream& out, const std::filesystem::path& path);

}  // namespace bsp2::jobs
