#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t most_heights = 20'000'000;

/// Heights that have few digits are whole numbers of a power of two, so that facets that are in one plane are
/// so exactly: hundredths and grey values would be off by their rounding, and their landscape would have
/// very many planes that are nearly one.
struct Heights {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;  // row by row, the first one at y = 0
  double lowest = 0;           // of those that are given
  double one = 1;              // in the unit of values and lowest
  /// @param per_unit whole numbers that are 1 together. A power of two of them is the unit, so that heights
  /// are not stretched much against x and y.
  void set_whole(double per_unit) {
    const double power = std::exp2(std::ceil(std::log2(per_unit)));
    one = per_unit / power;
    for (double& value : values) value /= power;
    lowest /= power;
  }
};

/// Digits behind the point in a number as text, or nothing where it is written with an exponent.
std::optional<std::size_t> decimals_of(const std::string& word) {
  if (word.find_first_not_of("+-.0123456789") != std::string::npos) return std::nullopt;
  const auto point = word.find('.');
  return point == std::string::npos ? 0 : word.size() - point - 1;
}

/// Heights with so many digits behind the point, where their whole numbers have few enough to be exact, also
/// their quarters.
void count_in_decimals(Heights& heights, std::size_t decimals) {
  constexpr std::size_t most_decimals = 9;
  if (decimals > most_decimals) return;
  const double per_unit = std::pow(10.0, static_cast<double>(decimals));
  const auto whole = [&](double value) { return std::nearbyint(value * per_unit); };
  for (const double value : heights.values)
    if (std::fabs(whole(value)) > 0x1p40) return;
  for (double& value : heights.values) value = whole(value);
  heights.lowest = whole(heights.lowest);
  heights.set_whole(per_unit);
}

/// One row a line; missing values are 0, lines that begin with # say nothing.
Heights read_table(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error("surface: " + path.string() + " cannot be read");
  std::vector<std::vector<double>> rows;
  Heights heights;
  std::optional<std::size_t> decimals = 0;  // of the number that has most of them
  for (std::string line; std::getline(file, line);) {
    if (const auto first = line.find_first_not_of(" \t\r\v\f");
        first == std::string::npos || line[first] == '#')
      continue;
    auto& row = rows.emplace_back();
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      char* end = nullptr;
      row.push_back(std::strtod(word.c_str(), &end));
      if (*end != '\0' || !std::isfinite(row.back()))
        throw Error("surface: " + path.string() + " holds '" + word.substr(0, 40) + "', which is no height");
      const auto of_word = decimals_of(word);
      decimals = decimals && of_word ? std::optional(std::max(*decimals, *of_word)) : std::nullopt;
    }
    heights.columns = std::max(heights.columns, row.size());
  }
  heights.rows = rows.size();
  if (heights.rows * heights.columns > most_heights)
    throw Error("surface: " + path.string() + " has more than 20 million heights");
  heights.lowest = std::numeric_limits<double>::infinity();
  for (auto& row : rows) {
    heights.lowest = std::min(heights.lowest, *std::min_element(row.begin(), row.end()));
    row.resize(heights.columns);
    heights.values.insert(heights.values.end(), row.begin(), row.end());
  }
  if (decimals && *decimals > 0) count_in_decimals(heights, *decimals);
  return heights;
}

/// The pixels of a PNG file as they stand in it, eight bits a channel: red, green, blue, opacity. Gamma makes
/// no difference.
class PngFile {
 public:
  explicit PngFile(const std::filesystem::path& path)
      : path_(path), file_(std::fopen(path.c_str(), "rb"), std::fclose) {
    if (!file_) throw Error("surface: " + path.string() + " cannot be read");
    png_ = png_create_read_struct(
        PNG_LIBPNG_VER_STRING, this,
        [](png_structp png, png_const_charp text) {
          static_cast<PngFile*>(png_get_error_ptr(png))->message_ = text;
          png_longjmp(png, 1);
        },
        [](png_structp, png_const_charp) {});
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
    if (info_ != nullptr) return;
    png_destroy_read_struct(&png_, nullptr, nullptr);
    throw std::bad_alloc();
  }
  ~PngFile() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  void read() {
    if (!read_header()) fail();
    if (std::uint64_t{width} * height > most_heights)
      throw Error("surface: " + path_.string() + " has more than 20 million pixels");
    pixels.resize(std::size_t{4} * width * height);
    rows_.resize(height);
    for (std::size_t y = 0; y < height; ++y) rows_[y] = pixels.data() + std::size_t{4} * width * y;
    if (!read_rows()) fail();
  }

  png_uint_32 width = 0, height = 0;
  std::vector<png_byte> pixels;  // row by row from the top

 private:
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::vector<png_bytep> rows_;
  std::string message_;

  [[noreturn]] void fail() const {
    throw Error("surface: " + path_.string() + " cannot be read: " + message_);
  }

  // libpng comes back from an error by a long jump, so these two hold nothing that has to be destroyed.
  bool read_header() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_init_io(png_, file_.get());
    png_read_info(png_, info_);
    width = png_get_image_width(png_, info_), height = png_get_image_height(png_, info_);
    png_set_expand(png_);
    png_set_strip_16(png_);
    png_set_gray_to_rgb(png_);
    png_set_add_alpha(png_, 255, PNG_FILLER_AFTER);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }
  bool read_rows() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows_.data());
    png_read_end(png_, nullptr);
    return true;
  }
};

/// Grey values from 0 to 100, the lowest row of the picture at y = 0. `invert` means 1 minus the value from 0
/// to 255, as in OpenSCAD: the landscape lies below 0.
Heights read_png(const std::filesystem::path& path, bool invert) {
  PngFile file(path);
  file.read();
  constexpr double full = 10000;  // the weights of red, green and blue together, as whole numbers
  Heights heights{file.height, file.width, {}};
  heights.values.reserve(heights.rows * heights.columns);
  for (std::size_t y = heights.rows; y-- > 0;)
    for (std::size_t x = 0; x < heights.columns; ++x) {
      const png_byte* pixel = file.pixels.data() + 4 * (y * heights.columns + x);
      const double grey = 2126 * pixel[0] + 7152 * pixel[1] + 722 * pixel[2];
      heights.values.push_back(invert ? full - grey : grey);
    }
  heights.lowest = *std::min_element(heights.values.begin(), heights.values.end());
  heights.set_whole(255 * full / 100);
  return heights;
}

}  // namespace

Landscape import_surface(const std::filesystem::path& path, bool center, bool invert) {
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const Heights heights = kind == ".png" ? read_png(path, invert) : read_table(path);
  Landscape landscape{.mesh = {}, .unit = 1 / heights.one};
  ImportedMesh& mesh = landscape.mesh;
  if (heights.rows < 2 || heights.columns < 2) return landscape;
  const auto rows = static_cast<std::uint32_t>(heights.rows),
             columns = static_cast<std::uint32_t>(heights.columns);
  const double left = center ? -0.5 * (columns - 1) : 0, front = center ? -0.5 * (rows - 1) : 0;
  const double base = std::min(0.0, heights.lowest - heights.one);
  const auto height = [&](std::uint32_t x, std::uint32_t y) {
    return heights.values[std::size_t{y} * columns + x];
  };
  const auto add = [&](double x, double y, double z) {
    mesh.points.push_back({left + x, front + y, z});
    return static_cast<std::uint32_t>(mesh.points.size() - 1);
  };
  const auto face = [&](std::initializer_list<std::uint32_t> corners) {  // clockwise seen from outside
    mesh.faces.corners.insert(mesh.faces.corners.end(), corners);
    mesh.faces.end_face();
  };
  for (std::uint32_t y = 0; y < rows; ++y)
    for (std::uint32_t x = 0; x < columns; ++x) add(x, y, height(x, y));
  const auto at = [&](std::uint32_t x, std::uint32_t y) { return y * columns + x; };
  for (std::uint32_t y = 0; y + 1 < rows; ++y)
    for (std::uint32_t x = 0; x + 1 < columns; ++x) {
      const std::uint32_t a = at(x, y), b = at(x + 1, y), c = at(x + 1, y + 1), d = at(x, y + 1);
      const std::uint32_t middle = add(
          x + 0.5, y + 0.5, (height(x, y) + height(x + 1, y) + height(x + 1, y + 1) + height(x, y + 1)) / 4);
      face({b, a, middle});
      face({c, b, middle});
      face({d, c, middle});
      face({a, d, middle});
    }
  // Around the border counter-clockwise: a wall below each edge, and the floor.
  std::vector<std::uint32_t> border;
  for (std::uint32_t x = 0; x + 1 < columns; ++x) border.push_back(at(x, 0));
  for (std::uint32_t y = 0; y + 1 < rows; ++y) border.push_back(at(columns - 1, y));
  for (std::uint32_t x = columns - 1; x > 0; --x) border.push_back(at(x, rows - 1));
  for (std::uint32_t y = rows - 1; y > 0; --y) border.push_back(at(0, y));
  const auto first = static_cast<std::uint32_t>(mesh.points.size()),
             n = static_cast<std::uint32_t>(border.size());
  for (const std::uint32_t corner : border) {
    const Point3 top = mesh.points[corner];
    mesh.points.push_back({top[0], top[1], base});
  }
  for (std::uint32_t i = 0; i < n; ++i)
    face({border[i], border[(i + 1) % n], first + (i + 1) % n, first + i});
  for (std::uint32_t i = 0; i < n; ++i) mesh.faces.corners.push_back(first + i);
  mesh.faces.end_face();
  return landscape;
}

}  // namespace bsp2::model
