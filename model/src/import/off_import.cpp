#include "import/imports.hpp"
#include "import/text_cursor.hpp"

namespace bsp2::model {
namespace {

/// The first word of a line that is not blank; empty at the end of the text.
std::string_view first_word(TextCursor& text) { return text.token(); }

/// The keyword says what else there is about a point; the coordinates come first in any case. It may be
/// missing.
/// @return the first count.
std::size_t read_keyword(TextCursor& text) {
  std::string_view word = first_word(text);
  if (word.ends_with("OFF")) {
    const std::string_view prefix = word.substr(0, word.size() - 3);
    if (prefix.find_first_not_of("STCN") != std::string_view::npos)
      text.fail("'" + std::string(prefix.substr(0, 20)) + "OFF' is not a mesh in three dimensions");
    word = first_word(text);
    if (word == "BINARY") text.fail("binary OFF files are not read");
  } else if (word.find_first_not_of("0123456789") != std::string_view::npos) {
    text.fail_at(word, "'OFF' at the beginning");
  }
  return text.count(word);
}

}  // namespace

ImportedMesh import_off(std::string_view bytes, const std::filesystem::path& path) {
  TextCursor text(bytes, path, '#');
  const std::size_t points = read_keyword(text), faces = text.count(text.token());
  text.end_line();  // after the number of edges, which nobody needs
  // A point takes 6 bytes, a face 2.
  if (points > text.bytes_left() / 6 || faces > text.bytes_left() / 2)
    text.fail("the numbers of points and faces are " + std::to_string(points) + " and " +
              std::to_string(faces) + ", more than the file holds; it is cut off");
  ImportedMesh mesh;
  mesh.points.reserve(points);
  for (std::size_t i = 0; i < points; ++i) {
    Point3 point;
    point[0] = text.coordinate(first_word(text));
    point[1] = text.coordinate(text.word());
    point[2] = text.coordinate(text.word());
    mesh.add_point(point);
    text.end_line();
  }
  std::vector<std::uint32_t> corners;
  for (std::size_t f = 0; f < faces; ++f) {
    const std::size_t size = text.count(first_word(text));
    if (size < 3) text.fail("face " + std::to_string(f) + " has fewer than three corners");
    corners.clear();
    for (std::size_t k = 0; k < size; ++k) {
      const std::size_t index = text.count(text.word());
      if (index >= points)
        text.fail("face " + std::to_string(f) + " names point " + std::to_string(index) + ", but there are " +
                  std::to_string(points) + ", the first being 0");
      corners.push_back(static_cast<std::uint32_t>(index));
    }
    mesh.add_face(corners);
    text.end_line();
  }
  return mesh;
}

}  // namespace bsp2::model
