#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>

// How a large file takes the place of another: it is written beside it, brought to the disk, and only then
// renamed. For the program and for the modules, which take nothing from it: each has these compiled in.

namespace bsp2::io {

/// Where it is written: `.NAME.part` in the same folder.
std::filesystem::path unfinished_name(const std::filesystem::path& path);

/// Whether a file of so many bytes can be written beside `path`. @return what is missing; empty if nothing
/// is, or if nobody knows.
std::string lack_of_room(const std::filesystem::path& path, std::uint64_t bytes);

/// Writes all of it. @return false if the system does not: `errno` has the reason.
bool write_at(int descriptor, std::uint64_t at, const void* from, std::size_t bytes);

/// To the disk, not only to the system's cache. Nothing where the file system cannot do that. @param flags to
/// open it with.
std::error_code sync_to_disk(const std::filesystem::path& path, int flags);

/// Gives what is written under its unfinished name the name of `path`: whenever the machine stops, there is a
/// whole file, the old or the new one.
std::error_code put_in_place(const std::filesystem::path& path);

}  // namespace bsp2::io
