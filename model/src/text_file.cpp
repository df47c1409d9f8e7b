#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/csg.hpp"
#include "imports.hpp"

namespace bsp2::model {
namespace {

[[noreturn]] void refuse(const std::string& name, const std::error_code& why) {
  throw Error(name + ": cannot be read: " + why.message() +
              (why == std::errc::permission_denied ? "; it takes the right to read the file and to enter the folders above it" : ""));
}

}  // namespace

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

std::string read_text(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    throw Error(name + ": no such file" + (name == "-" ? "; standard input is /dev/stdin" : "") +
                (error && error != std::errc::no_such_file_or_directory ? " (" + error.message() + ")" : ""));
  if (std::filesystem::is_directory(status)) throw Error(name + ": is a directory, not a model file");
  if (status.type() == std::filesystem::file_type::none) refuse(name, error);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) refuse(name, {errno, std::generic_category()});
  std::string text;
  if (const auto size = std::filesystem::file_size(path, error); !error) text.reserve(size + 1);
  for (std::size_t chunk = std::size_t{1} << 20, got = chunk; got == chunk;) {
    const std::size_t before = text.size();
    text.resize(before + chunk);
    got = std::fread(text.data() + before, 1, chunk, file.get());
    text.resize(before + got);
  }
  if (std::ferror(file.get())) refuse(name, {errno, std::generic_category()});
  if (text.empty()) throw Error(name + ": is empty, so it holds no model");
  return text;
}

std::string read_model_text(const std::filesystem::path& path) {
  std::string text = read_text(path);
  if (const std::string ending = lower_ending(path); is_mesh_ending(ending) || ending == ".dxf" || ending == ".svg")
    throw Error(path.string() + ": is no model but something that a model imports; write import(file = \"" + path.filename().string() +
                "\"); into a .csg file and run that");
  if (text.starts_with("\x89HDF"))
    throw Error(path.string() + ": is a snapshot, not a model; 'bsp2 info' tells what it holds, 'bsp2 resume' goes on with it, 'bsp2 export' writes its mesh");
  return text;
}

}  // namespace bsp2::model
