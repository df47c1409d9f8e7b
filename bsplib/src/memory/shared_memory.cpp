#include "memory/shared_memory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <random>
#include <system_error>

namespace bsp2::bsplib {

namespace {

using Name = std::array<char, 48>;
constexpr const char* folder = "/dev/shm";  // of the segments, and what their names begin with there
constexpr const char* prefix = "bsp2-shared-";

/// What is left to others, for each rank: Open MPI's own messages between the ranks of a node take 4 MiB.
constexpr std::size_t spare_bytes = std::size_t{4} << 20;

int size_of(MPI_Comm comm) {
  int size = 0;
  MPI_Comm_size(comm, &size);
  return size;
}

int rank_in(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

/// Where the parts begin, in whole pages, and the end; empty if they are too large to be counted.
std::vector<std::size_t> lay_out(MPI_Comm node, std::size_t bytes) {
  constexpr std::size_t most = std::numeric_limits<off_t>::max();
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  std::vector<std::uint64_t> sizes(static_cast<std::size_t>(size_of(node)));
  const std::uint64_t mine = bytes;
  MPI_Allgather(&mine, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, node);
  std::vector<std::size_t> begins{0};
  for (const std::uint64_t size : sizes) {
    if (size > most - page || begins.back() > most - page - size) return {};
    begins.push_back(begins.back() + (size / page + 1) * page);
  }
  return begins;
}

/// Takes the bytes from the file system now, since a later lack of them would be a signal.
bool take(int file, std::size_t bytes) {
  int error = EINTR;
  while (error == EINTR) error = posix_fallocate(file, 0, static_cast<off_t>(bytes));
  return error == 0;
}

/// Only one process of a node looks and takes at a time, so that several worlds do not count on the same
/// room. Nothing waits for another process meanwhile.
class Turn {
 public:
  Turn() : folder_(open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    while (folder_ >= 0 && flock(folder_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~Turn() {
    if (folder_ >= 0) ::close(folder_);
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  int folder_;
};

/// Whether so much is left when `bytes` are taken.
bool leaves_room(int file, std::size_t bytes, std::size_t spare) {
  struct statvfs system {};
  if (fstatvfs(file, &system) != 0) return false;
  const bool unlimited = system.f_blocks == 0;
  return unlimited || system.f_bavail >= bytes / system.f_frsize + spare / system.f_frsize;
}

/// Who makes a segment holds a lock on it as long as it has a name. The lock ends with its holder, also where
/// that was killed.
bool is_locked(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return true;  // that of another user, or gone
  const bool locked = flock(file, LOCK_EX | LOCK_NB) != 0;
  ::close(file);
  return locked;
}

/// Names that programs left behind which were killed while they made a segment. A young one may be about to
/// be locked.
void remove_left_behind() {
  namespace fs = std::filesystem;
  std::error_code none;
  const auto old = fs::file_time_type::clock::now() - std::chrono::minutes(1);
  for (fs::directory_iterator file(folder, none), end; !none && file != end; file.increment(none)) {
    std::error_code gone;
    if (!file->path().filename().string().starts_with(prefix)) continue;
    if (!fs::is_regular_file(file->symlink_status(gone))) continue;
    if (file->last_write_time(gone) < old && !gone && !is_locked(file->path()))
      fs::remove(file->path(), gone);
  }
}

/// A new segment, locked; -1 and an empty name if there is none. The room is looked at before anybody takes
/// of it: others must not find the file system full even for a moment.
int create_now(Name& name, std::size_t bytes, std::size_t spare) {
  std::random_device random;
  const auto number = (std::uint64_t{random()} << 32U) | random();
  std::snprintf(name.data(), name.size(), "/%s%d-%016llx", prefix, static_cast<int>(getpid()),
                static_cast<unsigned long long>(number));
  static const bool removed = (remove_left_behind(), true);  // once is enough
  static_cast<void>(removed);
  const int file = shm_open(name.data(), O_CREAT | O_EXCL | O_RDWR, S_IRUSR | S_IWUSR);
  if (file >= 0) flock(file, LOCK_SH);  // without it, too, the segment serves
  {
    const Turn turn;
    if (file >= 0 && leaves_room(file, bytes, spare) && take(file, bytes)) return file;
  }
  if (file >= 0) {
    shm_unlink(name.data());
    ::close(file);
  }
  name = {};
  return -1;
}

/// The others wait for the name, so nothing is thrown. Nothing that may throw follows the making of the file.
int create(Name& name, std::size_t bytes, std::size_t spare) noexcept {
  try {
    return create_now(name, bytes, spare);
  } catch (const std::exception&) {
    name = {};
    return -1;
  }
}

std::byte* map(int file, std::size_t bytes) {
  void* place = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  return place == MAP_FAILED ? nullptr : static_cast<std::byte*>(place);
}

}  // namespace

bool all_have(MPI_Comm comm, bool mine) {
  int have = mine, all = 0;
  MPI_Allreduce(&have, &all, 1, MPI_INT, MPI_MIN, comm);
  return all != 0;
}

SharedMemory::SharedMemory(MPI_Comm node, std::size_t bytes) : begins_(lay_out(node, bytes)) {
  if (begins_.empty()) return;
  const auto rank = static_cast<std::size_t>(rank_in(node));
  const std::size_t total = begins_.back(), spare = spare_bytes * (begins_.size() - 1);
  Name name{};
  int file = rank == 0 ? create(name, total, spare) : -1;
  MPI_Bcast(name.data(), static_cast<int>(name.size()), MPI_CHAR, 0, node);
  if (name[0] == '\0') return;
  if (rank != 0) file = shm_open(name.data(), O_RDWR, 0);
  const bool is_open = all_have(node, file >= 0);
  if (rank == 0) shm_unlink(name.data());
  if (is_open) base_ = map(file, total);
  if (file >= 0) ::close(file);
  if (!all_have(node, base_ != nullptr)) release();
}

SharedMemory& SharedMemory::operator=(SharedMemory&& other) noexcept {
  std::swap(base_, other.base_);
  begins_.swap(other.begins_);
  return *this;
}

void SharedMemory::release() {
  if (base_) munmap(base_, begins_.back());
  base_ = nullptr;
}

std::vector<std::byte*> parts_by_rank(MPI_Comm comm, MPI_Comm node, const SharedMemory& memory) {
  const auto node_size = static_cast<std::size_t>(size_of(node));
  std::vector<std::byte*> parts(static_cast<std::size_t>(size_of(comm)), nullptr);
  std::vector<int> ranks(node_size), in_comm(node_size);
  for (std::size_t i = 0; i < node_size; ++i) ranks[i] = static_cast<int>(i);
  MPI_Group group, node_group;
  MPI_Comm_group(comm, &group);
  MPI_Comm_group(node, &node_group);
  MPI_Group_translate_ranks(node_group, static_cast<int>(node_size), ranks.data(), group, in_comm.data());
  for (std::size_t i = 0; i < node_size; ++i)
    parts[static_cast<std::size_t>(in_comm[i])] = memory.part(static_cast<int>(i));
  MPI_Group_free(&group);
  MPI_Group_free(&node_group);
  return parts;
}

}  // namespace bsp2::bsplib
