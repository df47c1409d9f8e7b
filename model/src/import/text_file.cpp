#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <string_view>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "import/imports.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t chunk = std::size_t{1} << 20;

[[noreturn]] void refuse(const std::string& name, const std::error_code& why) {
  throw Error(name + ": cannot be read: " + why.message() +
              (why == std::errc::permission_denied
                   ? "; it takes the right to read the file and to enter the folders above it"
                   : ""));
}

/// What a file is by its first bytes, if it is none that holds a model as text.
std::string kind_of_other(std::string_view text) {
  struct Kind {
    std::string_view beginning, told;
  };
  using namespace std::string_view_literals;
  static constexpr Kind kinds[] = {
      {"\x89PNG"sv, "a picture (PNG), not a model; 'surface(file = ...)' in a model takes one as heights"},
      {"\xFF\xD8\xFF"sv, "a picture (JPEG), not a model"},
      {"PK\x03\x04"sv, "a ZIP archive, not a model; unpack it"},
      {"%PDF"sv, "a PDF, not a model"},
      {"\x1F\x8B"sv, "compressed by gzip; unpack it"}};
  for (const Kind& kind : kinds)
    if (text.starts_with(kind.beginning)) return std::string(kind.told);
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return first != std::string_view::npos && text[first] == '<' ? "XML or HTML, not a model as text" : "";
}

/// What is no text would be read to its end, which /dev/zero does not have, and a snapshot of many gigabytes
/// late.
void check_beginning_of_model(const std::string& text, const std::string& name) {
  if (text.starts_with("\x89HDF"))
    throw Error(name +
                ": is a snapshot, not a model; 'bsp2 info' tells what it holds, 'bsp2 resume' goes on with "
                "it, 'bsp2 export' writes its mesh");
  if (const std::string other = kind_of_other(text); !other.empty()) {
    const std::string ending = lower_ending(name);
    const bool is_of_text = ending.empty() || ending == ".csg" || ending == ".scad";
    throw Error(name + ": is " + other +
                (other.starts_with("XML") && !is_of_text ? ": " + why_not_read(ending) : ""));
  }
  constexpr std::string_view signature("\x89HDF\r\n\x1a\n", 8);
  std::size_t alike = 0;
  for (std::size_t i = 0; i < std::min(signature.size(), text.size()); ++i)
    alike += text[i] == signature[i] ? 1 : 0;
  if (alike >= signature.size() / 2)  // no text has so many of these bytes there
    throw Error(name + ": is no model; it looks like a snapshot whose first bytes are damaged");
  const bool is_utf16 = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");  // the reader says so
  if (const std::size_t zero = text.find('\0');
      text.size() >= chunk && zero != std::string::npos && !is_utf16)
    throw Error(name + ": is no text, so it holds no model: byte " + std::to_string(zero) + " is 0");
}

/// @param check is called with the first chunk, and throws if it is not worth while to read on.
std::string read_file(const std::filesystem::path& path,
                      void (*check)(const std::string& text, const std::string& name)) {
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
  const auto size = std::filesystem::file_size(path, error);
  text.reserve(
      error || size == 0
          ? chunk
          : size + 1);  // one more, so that the end is met; of some files it is told that they have none
  for (bool more = true; more;) {
    const std::size_t before = text.size(), reserved = text.capacity() - before,
                      room = reserved == 0 ? chunk : std::min(chunk, reserved);
    text.resize(before + room);
    const std::size_t got = std::fread(text.data() + before, 1, room, file.get());
    text.resize(before + got);
    if (before == 0) check(text, name);
    more = got == room;
  }
  if (std::ferror(file.get())) refuse(name, {errno, std::generic_category()});
  if (text.empty()) throw Error(name + ": is empty, so it holds no model");
  return text;
}

}  // namespace

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

std::string read_text(const std::filesystem::path& path) {
  return read_file(path, [](const std::string&, const std::string&) {});
}

bool is_imported(const std::filesystem::path& path) {
  const std::string ending = lower_ending(path);
  return is_mesh_ending(ending) || ending == ".dxf" || ending == ".svg";
}

std::string read_model_text(const std::filesystem::path& path) {
  std::error_code error;
  const bool is_file = std::filesystem::is_regular_file(path, error);
  if (const std::string ending = lower_ending(path); is_file && is_written_alone(ending))
    throw Error(path.string() + ": " + why_not_read(ending));
  if (!is_file || !is_imported(path)) return read_file(path, check_beginning_of_model);
  std::string text = "import(file = \"";
  for (const char c : path.filename().string()) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + "\");\n";
}

}  // namespace bsp2::model
