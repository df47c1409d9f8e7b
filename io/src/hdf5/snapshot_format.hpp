#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "hdf5/hdf5.hpp"

// What the writer and the reader of snapshots agree on beyond the names in the file.

namespace bsp2::io::snapshot {

inline const std::string format_name = "bsp2 snapshot";
/// Those of version 5 are read, too: what their meshes do not tell is found again.
inline constexpr std::int32_t format_version = 6, oldest_version = 5;

/// The groups that a snapshot may have or not.
inline constexpr const char *surface_group = "surface", *faces_group = "faces";

/// The coordinates of the eye are attributes; they are there only if there is an eye.
inline std::string eye_attribute(std::size_t axis) { return "eye_" + std::to_string(axis + 1); }

/// Metadata with checksums, and no open dataset that keeps a file open after it was closed.
inline hdf5::Handle file_access() {
  hdf5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  hdf5::check(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
  hdf5::check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG));
  return access;
}

/// Is it ours, and of this version? @throws Error if not.
void check_format(hid_t file, const std::filesystem::path& path);

/// What is read of a snapshot: `read(file)`. @throws Error that says what is wrong with it.
template <typename Read>
auto of_file(const std::filesystem::path& path, const Read& read) {
  const hdf5::Silence silence;
  try {
    if (H5Fis_hdf5(path.c_str()) <= 0)
      throw Error("'" + path.string() + "' is no snapshot of bsp2, or it is damaged");
    const hdf5::Handle access = file_access();
    const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
    check_format(file, path);
    return read(static_cast<hid_t>(file));
  } catch (const hdf5::Failure& failure) {
    throw Error("the snapshot '" + path.string() + "' is damaged or truncated (" + failure.what() + ")");
  } catch (const std::length_error&) {
    throw Error("the snapshot '" + path.string() + "' is damaged (an array of impossible length)");
  }
}

/// As the functions of io; the path has been looked at.
void write(const std::filesystem::path& path, const Snapshot& snapshot, const SnapshotWriters& writers);
Snapshot read(const std::filesystem::path& path, SnapshotPart part,
              const std::function<bool(std::uint32_t region)>& wanted);
bool is_of_others(const std::filesystem::path& path);
void add_surface(const std::filesystem::path& path, const geometry::TriangleSurface& surface,
                 const geometry::Brep* faces);
std::optional<SnapshotSurface> read_surface(const std::filesystem::path& path, std::int32_t parts,
                                            bool with_faces);

}  // namespace bsp2::io::snapshot
