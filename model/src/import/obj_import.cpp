#include <algorithm>
#include <charconv>
#include <iterator>
#include <optional>
#include <utility>

#include "import/imports.hpp"
#include "import/text_cursor.hpp"

namespace bsp2::model {
namespace {

/// "7", "7/1", "7//3", "-1/2/3": the number of a point, from 1, or from the last one backwards.
std::uint32_t point_of(std::string_view word, std::size_t points, const TextCursor& text) {
  const std::string_view number = word.substr(0, word.find('/'));
  std::int64_t index = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), index);
  if (number.empty() || error != std::errc() || end != number.data() + number.size())
    text.fail_at(word, "the number of a point");
  if (index < 0) index += static_cast<std::int64_t>(points) + 1;
  if (index < 1 || index > static_cast<std::int64_t>(points))
    text.fail("a face names point " + std::string(number) + ", but there are " + std::to_string(points) +
              " so far, the first being 1");
  return static_cast<std::uint32_t>(index - 1);
}

/// What else there is in such a file: it does not bound a solid. Source: the format's specification 3.0.
bool is_passed_over(std::string_view keyword) {
  constexpr std::string_view keywords[] = {
      "vt",     "vn",     "vp",     "p",      "l",        "o",          "g",        "s",    "mg",
      "usemtl", "mtllib", "usemap", "maplib", "bevel",    "lod",        "cstype",   "deg",  "bmat",
      "step",   "curv",   "curv2",  "surf",   "parm",     "trim",       "hole",     "scrv", "sp",
      "end",    "con",    "ctech",  "stech",  "c_interp", "d_interp",   "call",     "csh",  "fo",
      "bsp",    "bzp",    "cdc",    "cdp",    "res",      "shadow_obj", "trace_obj"};
  return std::find(std::begin(keywords), std::end(keywords), keyword) != std::end(keywords);
}

/// The first line that is not understood; files may have some of their own, beside a mesh.
class UnreadLine {
 public:
  void note(const TextCursor& text, std::string_view keyword) {
    if (!first_) first_.emplace(text, keyword);
  }
  /// @throws bsp2::Error if there is one.
  void refuse() const {
    if (first_) first_->first.fail_at(first_->second, "'v', 'f' or another keyword of OBJ files");
  }

 private:
  std::optional<std::pair<TextCursor, std::string_view>> first_;
};

}  // namespace

ImportedMesh import_obj(std::string_view bytes, const std::filesystem::path& path) {
  TextCursor text(bytes, path, '#');
  ImportedMesh mesh;
  UnreadLine unread;
  std::vector<std::uint32_t> corners;
  const auto next = [&] {  // a backslash at the end of a line continues it
    std::string_view word = text.word();
    while (word == "\\" && text.end_line()) word = text.word();
    return word;
  };
  do {
    const std::string_view keyword = text.word();
    if (keyword == "v") {
      Point3 point;
      for (double& x : point) x = text.coordinate(next());
      mesh.add_point(point);
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view word = next(); !word.empty(); word = next())
        corners.push_back(point_of(word, mesh.points.size(), text));
      if (corners.size() < 3) text.fail("a face of fewer than three corners");
      mesh.add_face(corners);
    } else if (!keyword.empty() && !is_passed_over(keyword)) {
      unread.note(text, keyword);
    }
  } while (text.end_line());
  if (mesh.faces.size() == 0) unread.refuse();
  return mesh;
}

}  // namespace bsp2::model
