#pragma once

// What the tests of drawings share: files written from texts, and areas and points of what is read.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::model {

using PlanePoint = std::array<double, 2>;

/// Twice a polygon's area, positive if it goes counter-clockwise.
inline double twice_area(const std::vector<PlanePoint>& points) {
  double twice = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PlanePoint &p = points[i], &q = points[(i + 1) % points.size()];
    twice += p[0] * q[1] - p[1] * q[0];
  }
  return twice;
}

/// The paths of a drawing.
inline std::vector<std::vector<PlanePoint>> paths_of(const PlaneDrawing& drawing) {
  std::vector<std::vector<PlanePoint>> paths;
  for (std::size_t f = 0; f < drawing.paths.size(); ++f) {
    auto& path = paths.emplace_back();
    for (const std::uint32_t corner : drawing.paths[f]) path.push_back(drawing.points[corner]);
  }
  return paths;
}

/// The area of paths that do not overlap.
inline double area_of(const PlaneDrawing& drawing) {
  double sum = 0;
  for (const auto& path : paths_of(drawing)) sum += std::fabs(twice_area(path)) / 2;
  return sum;
}

/// A file of a drawing, and what is said when it is read.
class DrawingFile {
 public:
  explicit DrawingFile(const std::string& name) : path_(folder_.path() / name) {}

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  void write(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }
  [[nodiscard]] Remarks remarks() {
    warnings.clear();
    notes.clear();
    return {[this](const std::string& text) { warnings.push_back(without_path(text)); },
            [this](const std::string& text) { notes.push_back(without_path(text)); }};
  }
  /// With "FILE" in the place of its path.
  [[nodiscard]] std::string without_path(std::string text) const {
    for (std::size_t at = 0; (at = text.find(path_.string())) != std::string::npos;)
      text.replace(at, path_.string().size(), "FILE");
    return text;
  }

  std::vector<std::string> warnings, notes;

 private:
  samples::TemporaryFolder folder_;
  std::filesystem::path path_;
};

}  // namespace bsp2::model
