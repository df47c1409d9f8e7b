#include "outputs/model_files.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "bsp2/model/expression/csg.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

std::string text_of(const fs::path& file) {
  std::error_code none;
  if (!fs::is_regular_file(file, none)) return {};
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Whether a `<` stands after `use` or `include`.
bool names_file(std::string_view text, std::size_t at) {
  const std::size_t end = at > 0 ? text.find_last_not_of(" \t", at - 1) : std::string_view::npos;
  const std::string_view before = end == std::string_view::npos ? "" : text.substr(0, end + 1);
  return before.ends_with("use") || before.ends_with("include");
}

/// A source with spaces for its comments.
std::string without_comments(std::string text) {
  enum class Within { code, string, path, line, block } within = Within::code;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : ' ';
    if (within == Within::string) {
      if (c == '\\') ++i;
      if (c == '"' || c == '\n') within = Within::code;
    } else if (within == Within::path) {
      if (c == '>' || c == '\n') within = Within::code;
    } else if (within == Within::code) {
      if (c == '"') within = Within::string;
      if (c == '<' && names_file(text, i)) within = Within::path;
      if (c == '/' && (next == '/' || next == '*')) {
        within = next == '/' ? Within::line : Within::block;
        text[i] = text[i + 1] = ' ';
        ++i;
        continue;
      }
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

/// Adds those that are there, or may come.
void add_named(const std::string& source, const fs::path& file, std::vector<fs::path>& files) {
  const fs::path folder = file.parent_path();
  const std::string text = without_comments(source);
  const auto add = [&](std::string_view name) {
    std::error_code none;
    const fs::path named = (folder / name).lexically_normal();
    // One that is missing may be made later; not every text in quotes is the name of a file.
    const bool may_come = (is_source(named) || model::is_imported(named)) && !fs::exists(named, none);
    if (!may_come && !fs::is_regular_file(named, none)) return;
    if (std::find(files.begin(), files.end(), named) == files.end()) files.push_back(named);
  };
  for_each_between(text, '"', '"', add);
  if (file.extension() == ".scad") for_each_between(text, '<', '>', add);
}

/// Of these, too, and of what they name.
std::vector<fs::path> with_named(std::vector<fs::path> files, std::size_t first) {
  for (std::size_t i = first; i < files.size(); ++i) {
    const fs::path file = files[i];
    if (is_source(file)) add_named(text_of(file), file, files);
  }
  return files;
}

}  // namespace

std::vector<fs::path> files_of_model(const fs::path& model) { return with_named({model}, 0); }

std::vector<fs::path> files_of_text(const std::string& text, const fs::path& model) {
  std::vector<fs::path> files{model};
  add_named(text, model, files);
  return with_named(std::move(files), 1);
}

}  // namespace bsp2::api
