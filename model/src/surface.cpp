#include <png.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t most_heights = 20'000'000;

struct Heights {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;  // row by row, the first one at y = 0
};

/// One row a line; missing values are 0, lines that begin with # say nothing.
Heights read_text(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error("surface: " + path.string() + " cannot be read");
  std::vector<std::vector<double>> rows;
  Heights heights;
  for (std::string line; std::getline(file, line);) {
    if (const auto first = line.find_first_not_of(" \t\r"); first == std::string::npos || line[first] == '#') continue;
    auto& row = rows.emplace_back();
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      char* end = nullptr;
      row.push_back(std::strtod(word.c_str(), &end));
      if (end == word.c_str() || !std::isfinite(row.back())) throw Error("surface: " + path.string() + " holds '" + word.substr(0, 40) + "', which is no height");
    }
    heights.columns = std::max(heights.columns, row.size());
  }
  heights.rows = rows.size();
  if (heights.rows * heights.columns > most_heights) throw Error("surface: " + path.string() + " has more than 20 million heights");
  for (auto& row : rows) {
    row.resize(heights.columns);
    heights.values.insert(heights.values.end(), row.begin(), row.end());
  }
  return heights;
}

/// Grey values from 0 to 100, the lowest row of the picture at y = 0.
Heights read_png(const std::filesystem::path& path, bool invert) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) throw Error("surface: " + path.string() + " cannot be read: " + image.message);
  Heights heights{image.height, image.width, {}};
  if (heights.rows * heights.columns > most_heights) {
    png_image_free(&image);
    throw Error("surface: " + path.string() + " has more than 20 million pixels");
  }
  image.format = PNG_FORMAT_RGBA;
  std::vector<png_byte> pixels(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0) throw Error("surface: " + path.string() + " cannot be read: " + image.message);
  for (std::size_t y = heights.rows; y-- > 0;)
    for (std::size_t x = 0; x < heights.columns; ++x) {
      const png_byte* pixel = pixels.data() + 4 * (y * heights.columns + x);
      const double grey = (0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2]) / 255;
      heights.values.push_back(100 * (invert ? 1 - grey : grey));
    }
  return heights;
}

}  // namespace

ImportedMesh import_surface(const std::filesystem::path& path, bool center, bool invert) {
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const Heights heights = kind == ".png" ? read_png(path, invert) : read_text(path);
  ImportedMesh mesh;
  if (heights.rows < 2 || heights.columns < 2) return mesh;
  const auto rows = static_cast<std::uint32_t>(heights.rows), columns = static_cast<std::uint32_t>(heights.columns);
  const double left = center ? -0.5 * (columns - 1) : 0, front = center ? -0.5 * (rows - 1) : 0;
  const double base = std::min(0.0, *std::min_element(heights.values.begin(), heights.values.end()) - 1);
  const auto height = [&](std::uint32_t x, std::uint32_t y) { return heights.values[std::size_t{y} * columns + x]; };
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
      const std::uint32_t middle = add(x + 0.5, y + 0.5, (height(x, y) + height(x + 1, y) + height(x + 1, y + 1) + height(x, y + 1)) / 4);
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
  const auto first = static_cast<std::uint32_t>(mesh.points.size()), n = static_cast<std::uint32_t>(border.size());
  for (const std::uint32_t corner : border) {
    const Point3 top = mesh.points[corner];
    mesh.points.push_back({top[0], top[1], base});
  }
  for (std::uint32_t i = 0; i < n; ++i) face({border[i], border[(i + 1) % n], first + (i + 1) % n, first + i});
  for (std::uint32_t i = 0; i < n; ++i) mesh.faces.corners.push_back(first + i);
  mesh.faces.end_face();
  return mesh;
}

}  // namespace bsp2::model
