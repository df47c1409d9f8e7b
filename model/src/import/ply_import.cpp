#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"
#include "import/text_cursor.hpp"

namespace bsp2::model {
namespace {

enum class Scalar : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

constexpr std::pair<std::string_view, Scalar> scalars[] = {
    {"char", Scalar::int8},      {"uchar", Scalar::uint8},    {"short", Scalar::int16},
    {"ushort", Scalar::uint16},  {"int", Scalar::int32},      {"uint", Scalar::uint32},
    {"float", Scalar::float32},  {"double", Scalar::float64}, {"int8", Scalar::int8},
    {"uint8", Scalar::uint8},    {"int16", Scalar::int16},    {"uint16", Scalar::uint16},
    {"int32", Scalar::int32},    {"uint32", Scalar::uint32},  {"float32", Scalar::float32},
    {"float64", Scalar::float64}};

constexpr std::size_t size_of(Scalar type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

struct Property {
  std::string_view name;
  Scalar type;
  std::optional<Scalar> count;  ///< of a list
};

struct Element {
  std::string_view name;
  std::size_t count;
  std::vector<Property> properties;
};

enum class Format : std::uint8_t { ascii, little, big };

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

Scalar scalar_of(std::string_view word, const TextCursor& text) {
  for (const auto& [name, type] : scalars)
    if (name == word) return type;
  text.fail_at(word, "a type of numbers");
}

Format format_of(std::string_view word, const TextCursor& text) {
  if (word == "ascii") return Format::ascii;
  if (word == "binary_little_endian") return Format::little;
  if (word == "binary_big_endian") return Format::big;
  text.fail_at(word, "'ascii', 'binary_little_endian' or 'binary_big_endian'");
}

Header read_header(TextCursor& text) {
  Header header;
  if (const auto word = text.word(); word != "ply") text.fail_at(word, "'ply' at the beginning");
  bool has_format = false;
  while (text.end_line()) {
    const std::string_view keyword = text.word();
    if (keyword == "format") {
      header.format = format_of(text.word(), text);
      has_format = true;
    } else if (keyword == "element") {
      const std::string_view name = text.word();
      header.elements.push_back({name, text.count(text.word()), {}});
    } else if (keyword == "property") {
      if (header.elements.empty()) text.fail("a property before any element");
      Property property{};
      std::string_view type = text.word();
      if (type == "list") {
        property.count = scalar_of(text.word(), text);
        type = text.word();
      }
      property.type = scalar_of(type, text);
      property.name = text.word();
      header.elements.back().properties.push_back(property);
    } else if (keyword == "end_header") {
      if (!has_format) text.fail("the header names no format");
      text.end_line();
      return header;
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      text.fail_at(keyword, "a line of the header");
    }
  }
  text.fail("the header has no end; the file is cut off");
}

/// The numbers of an ascii body.
class TextNumbers {
 public:
  explicit TextNumbers(TextCursor& text) : text_(text) {}
  double number(Scalar) {
    const std::string_view word = text_.token();
    const auto value = to_number(word);
    if (!value) text_.fail_at(word, "a number");
    return *value;
  }
  [[nodiscard]] std::size_t bytes_left() const { return text_.bytes_left(); }
  [[nodiscard]] std::size_t least_bytes(Scalar) const { return 2; }  // with the space before it
  [[noreturn]] void fail(const std::string& text) const { text_.fail(text); }

 private:
  TextCursor& text_;
};

/// Those of a binary one.
class BinaryNumbers {
 public:
  BinaryNumbers(std::string_view bytes, std::size_t at, bool is_big, const std::filesystem::path& path)
      : bytes_(bytes), at_(at), is_big_(is_big), path_(path) {}
  double number(Scalar type) {
    const std::size_t size = size_of(type);
    if (size > bytes_left()) fail("the file is cut off");
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i)
      bits |= std::uint64_t{static_cast<unsigned char>(bytes_[at_ + i])} << 8 * (is_big_ ? size - 1 - i : i);
    at_ += size;
    switch (type) {
      case Scalar::int8:
        return static_cast<std::int8_t>(bits);
      case Scalar::int16:
        return static_cast<std::int16_t>(bits);
      case Scalar::int32:
        return static_cast<std::int32_t>(bits);
      case Scalar::float32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case Scalar::float64:
        return std::bit_cast<double>(bits);
      default:
        return static_cast<double>(bits);
    }
  }
  [[nodiscard]] std::size_t bytes_left() const { return bytes_.size() - at_; }
  [[nodiscard]] std::size_t least_bytes(Scalar type) const { return size_of(type); }
  [[noreturn]] void fail(const std::string& text) const {
    throw Error(path_.string() + ": byte " + std::to_string(at_) + ": " + text);
  }

 private:
  std::string_view bytes_;
  std::size_t at_;
  bool is_big_;
  const std::filesystem::path& path_;
};

template <typename Numbers>
class Body {
 public:
  Body(Numbers& numbers, ImportedMesh& mesh) : numbers_(numbers), mesh_(mesh) {}

  void read(const Header& header) {
    for (const Element& element : header.elements) {
      if (element.properties.empty()) continue;
      if (element.count > numbers_.bytes_left())
        numbers_.fail(counted(element.count, "# element[s] '") + std::string(element.name.substr(0, 40)) +
                      "' are more than the file holds; it is cut off");
      if (element.name == "tristrips")
        numbers_.fail("strips of triangles are not read; convert them to faces");
      for (std::size_t i = 0; i < element.count; ++i) {
        if (element.name == "vertex")
          read_point(element);
        else
          read_other(element, element.name == "face");
      }
    }
    for (const std::uint32_t corner : mesh_.faces.corners)
      if (corner >= mesh_.points.size())
        numbers_.fail("a face names point " + std::to_string(corner) + ", but there are " +
                      std::to_string(mesh_.points.size()) + ", the first being 0");
  }

 private:
  void read_point(const Element& element) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    Point3 point{none, none, none};
    for (const Property& property : element.properties) {
      if (property.count) {
        read_list(property);
        continue;
      }
      const double value = numbers_.number(property.type);
      if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
        point[static_cast<std::size_t>(property.name[0] - 'x')] = value;
    }
    for (const double x : point)
      if (!(std::fabs(x) <= largest_coordinate))
        numbers_.fail("a coordinate of point " + std::to_string(mesh_.points.size()) +
                      " is missing, not finite or too large");
    mesh_.add_point(point);
  }

  void read_other(const Element& element, bool is_face) {
    for (const Property& property : element.properties) {
      if (!property.count) {
        numbers_.number(property.type);
        continue;
      }
      read_list(property);
      if (!is_face || (property.name != "vertex_indices" && property.name != "vertex_index")) continue;
      if (list_.size() < 3)
        numbers_.fail("face " + std::to_string(mesh_.faces.size()) + " has fewer than three corners");
      corners_.clear();
      for (const double index : list_) corners_.push_back(integer(index));
      mesh_.add_face(corners_);
    }
  }

  void read_list(const Property& property) {
    const std::uint32_t size = integer(numbers_.number(*property.count));
    if (size > numbers_.bytes_left() / numbers_.least_bytes(property.type))
      numbers_.fail("a list is longer than the file: " + counted(size, "# number[s]"));
    list_.clear();
    for (std::uint32_t i = 0; i < size; ++i) list_.push_back(numbers_.number(property.type));
  }

  std::uint32_t integer(double value) const {
    if (!(value >= 0 && value < 4294967295.0) || value != std::floor(value))
      numbers_.fail("expected a count or the number of a point, found another number");
    return static_cast<std::uint32_t>(value);
  }

  Numbers& numbers_;
  ImportedMesh& mesh_;
  std::vector<double> list_;
  std::vector<std::uint32_t> corners_;
};

}  // namespace

ImportedMesh import_ply(std::string_view bytes, const std::filesystem::path& path) {
  TextCursor text(bytes, path);
  const Header header = read_header(text);
  ImportedMesh mesh;
  if (header.format == Format::ascii) {
    TextNumbers numbers(text);
    Body(numbers, mesh).read(header);
  } else {
    BinaryNumbers numbers(bytes, text.offset(), header.format == Format::big, path);
    Body(numbers, mesh).read(header);
  }
  return mesh;
}

}  // namespace bsp2::model
