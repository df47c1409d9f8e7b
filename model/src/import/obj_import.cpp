#include <charconv>

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

}  // namespace

/// What else there is in such a file (normals, textures, materials, lines) does not bound a solid.
ImportedMesh import_obj(std::string_view bytes, const std::filesystem::path& path) {
  TextCursor text(bytes, path, '#');
  ImportedMesh mesh;
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
    }
  } while (text.end_line());
  return mesh;
}

}  // namespace bsp2::model
