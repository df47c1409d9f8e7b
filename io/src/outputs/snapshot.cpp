#include "bsp2/io/outputs/snapshot.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <mutex>
#include <string_view>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "files/replacing.hpp"
#include "outputs/modules.hpp"

// What is told about a path without HDF5; the rest is in the module.

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

/// What is read is a file: of a folder it is told which one is meant, and a pipe, which would be waited for,
/// is not opened.
void check_is_file(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) {
    const fs::path inside = path / "snapshot.h5";  // as -o calls it
    if (fs::exists(inside, error))
      throw Error("'" + path.string() + "' is a folder; its snapshot is '" + inside.string() + "'");
    throw Error(
        "'" + path.string() +
        "' is a folder without a snapshot.h5; name the file that 'bsp2 run' wrote with --snapshot or -o");
  }
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw Error("cannot read '" + path.string() +
                "': it is a pipe or a device, and a snapshot has to be a file");
}

/// HDF5 as distributions build it with MPI is not thread-safe, not even for different files, and threads of a
/// process may evaluate at once: one of them at a time is in it. Not where several write together: they wait
/// for each other in it, and ranks have one thread that does.
std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

bool is_hdf5(const fs::path& path) {
  std::error_code none;
  if (!fs::is_regular_file(path, none)) return false;  // a pipe can be read once
  std::array<char, 4> bytes{};
  std::ifstream(path, std::ios::binary).read(bytes.data(), bytes.size());
  return std::string_view(bytes.data(), bytes.size()) == "\x89HDF";
}

bool is_snapshot(const fs::path& path) {
  if (!is_hdf5(path)) return false;
  const std::lock_guard lock(hdf5_mutex());
  return !hdf5_module().is_of_others(path);
}

void check_snapshot_path(const fs::path& path) {
  check_folder(path.has_parent_path() ? path.parent_path() : ".");
  std::error_code error;
  if (!path.has_filename() || fs::is_directory(path, error))
    throw Error("cannot write the snapshot '" + path.string() + "': it is a directory");
  if (fs::exists(path, error) && !fs::is_regular_file(path, error))
    throw Error("cannot write the snapshot '" + path.string() + "': it is no regular file");
  hdf5_module();
}

void copy_snapshot(const fs::path& from, const fs::path& to) {
  std::error_code error;
  if (fs::equivalent(from, to, error)) return;
  const fs::path part = unfinished_name(to);
  const WritingLock lock(to);
  const std::uintmax_t bytes = fs::file_size(from, error);
  std::string why = lock.why_not();
  if (why.empty() && !error) why = lack_of_room(to, bytes);
  if (why.empty()) {
    fs::copy_file(from, part, fs::copy_options::overwrite_existing, error);
    if (!error) error = put_in_place(to);
    if (!error) return;
    why = error.message();
    std::error_code ignored;
    fs::remove(part, ignored);
  }
  throw Error("cannot write the snapshot '" + to.string() + "': " + why);
}

void check_snapshot_is_readable(const fs::path& path) {
  check_is_file(path);
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0)
    throw Error("cannot read '" + path.string() + "': " + std::generic_category().message(errno));
  ::close(descriptor);
}

void write_snapshot(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers) {
  std::unique_lock lock(hdf5_mutex(), std::defer_lock);
  if (writers.count == 1) lock.lock();
  hdf5_module().write_snapshot(path, snapshot, writers);
}

Snapshot read_snapshot(const fs::path& path, SnapshotPart part,
                       const std::function<bool(std::uint32_t)>& wanted) {
  check_snapshot_is_readable(path);
  const std::lock_guard lock(hdf5_mutex());
  return hdf5_module().read_snapshot(path, part, wanted);
}

void add_surface(const fs::path& path, const geometry::TriangleSurface& surface,
                 const geometry::Brep* faces) {
  const std::lock_guard lock(hdf5_mutex());
  hdf5_module().add_surface(path, surface, faces);
}

std::optional<SnapshotSurface> read_surface(const fs::path& path, std::int32_t parts, bool with_faces) {
  check_snapshot_is_readable(path);
  const std::lock_guard lock(hdf5_mutex());
  return hdf5_module().read_surface(path, parts, with_faces);
}

}  // namespace bsp2::io
