#pragma once

#include <cstdint>
#include <string>

#include "bsp2/io/outputs/snapshot.hpp"
#include "hdf5/hdf5.hpp"

// What the writer and the reader of snapshots agree on beyond the names in the file.

namespace bsp2::io::snapshot {

inline const std::string format_name = "bsp2 snapshot";
inline constexpr std::int32_t format_version = 5;

/// The coordinates of the eye are attributes; they are there only if there is an eye.
inline std::string eye_attribute(std::size_t axis) { return "eye_" + std::to_string(axis + 1); }

/// Metadata with checksums, and no open dataset that keeps a file open after it was closed.
inline hdf5::Handle file_access() {
  hdf5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  hdf5::check(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
  hdf5::check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG));
  return access;
}

/// As write_snapshot and read_snapshot; the path has been looked at.
void write(const std::filesystem::path& path, const Snapshot& snapshot, const SnapshotWriters& writers);
Snapshot read(const std::filesystem::path& path, SnapshotPart part,
              const std::function<bool(std::uint32_t region)>& wanted);

}  // namespace bsp2::io::snapshot
