#include "viewer/file_watch.hpp"

#include <sys/stat.h>

#include <algorithm>

#include "outputs/model_files.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;

FileWatch::FileWatch(fs::path model) : model_(std::move(model)) { begin(); }

FileWatch::Stamp FileWatch::stamp_of(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return {status.st_mtim.tv_sec, status.st_mtim.tv_nsec, status.st_ino,
          static_cast<std::uint64_t>(status.st_size)};
}

void FileWatch::begin() {
  stamps_.clear();
  changed_ = false;
  for (const fs::path& file : files_of_model(model_)) stamps_[file] = stamp_of(file);
}

bool FileWatch::has_changed() {
  constexpr auto between = std::chrono::milliseconds(100);
  const auto now = std::chrono::steady_clock::now();
  if (changed_ || now - looked_ < between) return changed_;
  looked_ = now;
  // One that is away is being saved: what comes back counts.
  changed_ = std::any_of(stamps_.begin(), stamps_.end(), [](const auto& each) {
    const Stamp stamp = stamp_of(each.first);
    return !(stamp == each.second) && !(stamp == Stamp{});
  });
  return changed_;
}

}  // namespace bsp2::api
