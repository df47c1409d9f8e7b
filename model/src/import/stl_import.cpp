#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"
#include "import/text_cursor.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t header_bytes = 84, facet_bytes = 50;

bool is_word(std::string_view word, std::string_view lower) {
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
}

std::uint32_t little_endian(const char* bytes) {
  unsigned char b[4];
  std::memcpy(b, bytes, 4);
  return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 |
         std::uint32_t{b[3]} << 24;
}

/// Headers of binary files may begin with "solid" as well: then their length tells, or a byte of 0 (in the
/// number of facets, or in the first of them), or that there is no facet in words.
bool is_ascii(std::string_view bytes) {
  if (bytes.size() >= header_bytes &&
      bytes.substr(0, header_bytes + 3 * facet_bytes).find('\0') != std::string_view::npos)
    return false;
  if (bytes.size() >= header_bytes &&
      bytes.size() == header_bytes + facet_bytes * std::uint64_t{little_endian(bytes.data() + 80)})
    return false;
  const std::size_t first = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  if (!is_word(bytes.substr(first, 5), "solid")) return false;
  std::string begin(bytes.substr(first, 4096));
  std::transform(begin.begin(), begin.end(), begin.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return bytes.size() < header_bytes || begin.find("facet") != std::string::npos ||
         begin.find("endsolid") != std::string::npos;
}

void read_loop(TextCursor& text, ImportedMesh& mesh) {
  std::vector<std::uint32_t> corners;
  for (std::string_view word = text.token(); !is_word(word, "endloop"); word = text.token()) {
    if (!is_word(word, "vertex")) text.fail_at(word, "'vertex' or 'endloop'");
    Point3 point;
    for (double& x : point) x = text.coordinate(text.word());
    corners.push_back(mesh.add_point(point));
  }
  if (corners.size() < 3) text.fail("a facet of fewer than three corners");
  mesh.add_face(corners);
}

ImportedMesh ascii(std::string_view bytes, const std::filesystem::path& path) {
  ImportedMesh mesh;
  TextCursor text(bytes, path);
  for (std::string_view word = text.token(); !word.empty(); word = text.token()) {
    if (!is_word(word, "solid")) text.fail_at(word, "'solid'");
    text.end_line();
    for (word = text.token(); !is_word(word, "endsolid"); word = text.token()) {
      if (!is_word(word, "facet")) text.fail_at(word, "'facet' or 'endsolid'");
      text.end_line();  // the normal follows from the corners
      if (word = text.token(); !is_word(word, "outer")) text.fail_at(word, "'outer loop'");
      if (word = text.token(); !is_word(word, "loop")) text.fail_at(word, "'outer loop'");
      read_loop(text, mesh);
      if (word = text.token(); !is_word(word, "endfacet")) text.fail_at(word, "'endfacet'");
    }
    text.end_line();
  }
  return mesh;
}

/// Whether what stands in place of a facet could be one. Its normal may be anything: some programs write none
/// for flat facets.
bool could_be_facet(const char* bytes) {
  constexpr float largest = 1e18F;
  for (std::size_t i = 3; i < 12; ++i)
    if (const float x = std::bit_cast<float>(little_endian(bytes + 4 * i)); !(std::fabs(x) <= largest))
      return false;
  return true;
}

/// How many facets to read. Programs that write as they go leave a count of 0, or a wrong one, in the header:
/// then the length of the file tells, if it is that of whole facets.
std::uint64_t count_facets(std::string_view bytes, const std::filesystem::path& path,
                           std::vector<std::string>& warnings) {
  const std::uint64_t told = little_endian(bytes.data() + 80), room = bytes.size() - header_bytes,
                      there = room / facet_bytes;
  const bool is_whole = room % facet_bytes == 0;
  if (told > there && (!is_whole || there == 0))
    throw Error(path.string() + ": byte 80: the number of facets is " + std::to_string(told) +
                ", which takes " +
                counted(header_bytes + facet_bytes * told, "# byte[s] in all, but the file has ") +
                std::to_string(bytes.size()) + "; it is cut off, or no STL file");
  if (told > there) {
    warnings.push_back(
        "the header says " + counted(told, "# facet[s], but the file ends after ") +
        counted(there,
                "#; [it is|these are] read. If the file is cut off, the rest is missing: get it again"));
    return there;
  }
  bool has_more = told < there && (is_whole || told == 0);
  for (std::uint64_t f = told; has_more && f < there; ++f)
    has_more = could_be_facet(bytes.data() + header_bytes + facet_bytes * f);
  if (has_more) {
    warnings.push_back(
        "the header says " + counted(told, "# facet[s], but by its length the file holds ") +
        counted(there,
                "#; [it is|all of them are] read. Write the file again with the right number to be sure"));
    return there;
  }
  if (told < there)
    warnings.push_back(counted(room - facet_bytes * told, "# byte[s] [is|are] passed over after the ") +
                       counted(told, "# facet[s] that the header tells of"));
  return told;
}

ImportedMesh binary(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.size() < header_bytes)
    throw Error(path.string() +
                ": neither an STL text, which begins with 'solid', nor long enough for a binary STL file, "
                "which has a header of 84 bytes");
  ImportedMesh mesh;
  const std::uint64_t facets = count_facets(bytes, path, mesh.warnings);
  mesh.points.reserve(3 * facets);
  for (std::uint64_t f = 0; f < facets; ++f) {
    std::uint32_t corners[3];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Point3 point;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t at = header_bytes + facet_bytes * f + 12 * (corner + 1) + 4 * i;
        point[i] = std::bit_cast<float>(little_endian(bytes.data() + at));
        if (!std::isfinite(point[i]))
          throw Error(path.string() + ": byte " + std::to_string(at) + ": a coordinate of facet " +
                      std::to_string(f) + " is not finite");
      }
      corners[corner] = mesh.add_point(point);
    }
    mesh.add_face(corners);
  }
  return mesh;
}

}  // namespace

ImportedMesh import_stl(std::string_view bytes, const std::filesystem::path& path) {
  return is_ascii(bytes) ? ascii(bytes, path) : binary(bytes, path);
}

}  // namespace bsp2::model
