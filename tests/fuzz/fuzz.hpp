#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

/// What the fuzz targets share. A target may answer with bsp2::Error or a value; anything else is a find.
namespace bsp2::fuzzing {

/// The input as a file in memory, with this ending; one name a process, so that nothing piles up.
inline std::filesystem::path file_of(const std::uint8_t* data, std::size_t size, const std::string& ending) {
  static const std::string folder = [] {
    std::string name = "/dev/shm/bsp2-fuzz-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    return name;
  }();
  const std::filesystem::path path = folder + "/input" + ending;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return path;
}

}  // namespace bsp2::fuzzing
