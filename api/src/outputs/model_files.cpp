#include "outputs/model_files.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A source with spaces for its comments.
std::string without_comments(std::string text) {
  enum class Within { code, string, line, block } within = Within::code;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : ' ';
    if (within == Within::string) {
      if (c == '\\') ++i;
      if (c == '"' || c == '\n') within = Within::code;
    } else if (within == Within::code) {
      if (c == '"') within = Within::string;
      if (c == '/' && (next == '/' || next == '*')) within = next == '/' ? Within::line : Within::block;
    } else if ((within == Within::line && c == '\n') ||
               (within == Within::block && c == '*' && next == '/')) {
      if (within == Within::block) text[i] = text[i + 1] = ' ';
      within = Within::code;
      continue;
    }
    if ((within == Within::line || within == Within::block) && c != '\n') text[i] = ' ';
  }
  return text;
}

/// What stands between two marks, in one line.
template <class Use>
void for_each_between(std::string_view text, char first, char last, const Use& use) {
  constexpr std::size_t longest = 4096;
  for (std::size_t at = text.find(first); at != std::string_view::npos; at = text.find(first, at)) {
    const std::size_t end = text.find_first_of(std::string{last, '\n'}, at + 1);
    if (end == std::string_view::npos) return;
    if (text[end] == last && end > at + 1 && end - at < longest) use(text.substr(at + 1, end - at - 1));
    at = text[end] == last ? end + 1 : end;
  }
}

bool is_source(const fs::path& file) { return file.extension() == ".scad" || file.extension() == ".csg"; }

}  // namespace

std::vector<fs::path> files_of_model(const fs::path& model) {
  std::vector<fs::path> files{model};
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!is_source(files[i])) continue;
    const fs::path folder = files[i].parent_path();
    const std::string text = without_comments(text_of(files[i]));
    const auto add = [&](std::string_view name) {
      std::error_code none;
      const fs::path file = (folder / name).lexically_normal();
      // One that is missing may be made later; not every text in quotes is the name of a file.
      const bool may_come = is_source(file) && !fs::exists(file, none);
      if (!may_come && !fs::is_regular_file(file, none)) return;
      if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
    };
    for_each_between(text, '"', '"', add);
    if (files[i].extension() == ".scad") for_each_between(text, '<', '>', add);
  }
  return files;
}

}  // namespace bsp2::api
