#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/geometry/surface/outline.hpp"

namespace bsp2::io {

enum class SheetFormat : std::uint8_t { dxf, pdf, svg };

/// The format that a file's ending names, in letters of any case.
std::optional<SheetFormat> sheet_format(const std::filesystem::path& path);

/// A page with lines, areas and words on it, in millimetres; x to the right, y up.
///
/// Later things cover earlier ones where a format has areas; DXF has the lines alone, and the outlines of
/// areas.
struct Sheet {
  using Point = std::array<double, 2>;
  using Rgb = std::array<std::uint8_t, 3>;
  /// How lines look, and what they are called: in DXF a layer, in SVG a group.
  struct Layer {
    std::string name;
    Rgb colour{0, 0, 0};
    double width = 0.25;         ///< of lines; 0: as thin as can be
    std::vector<double> dashes;  ///< lengths of lines and gaps in turns; none: solid
  };
  struct Path {
    std::uint32_t layer = 0;
    bool is_closed = false;
    std::vector<Point> points;  ///< two or more
  };
  /// What lies within an odd number of its loops.
  struct Area {
    std::uint32_t layer = 0;  ///< of its name; lines and dashes do not matter
    Rgb fill{};
    double opacity = 1;
    std::vector<geometry::OutlinePath> loops;
  };
  enum class Anchor : std::uint8_t { start, middle, end };
  struct Label {
    std::uint32_t layer = 0;
    Point at{};           ///< on the base line
    double height = 3.5;  ///< of capitals
    std::string text;     ///< a line of UTF-8
    Anchor anchor = Anchor::start;
    double turn = 0;  ///< degrees, counter-clockwise
  };

  std::string title;
  Point lower{}, upper{};       ///< corners of the page
  std::optional<int> decimals;  ///< of coordinates in text; none: as many as it takes to read them back
  std::vector<Layer> layers;
  std::vector<Area> areas;  ///< below all paths
  std::vector<Path> paths;
  std::vector<Label> labels;
};

/// The bytes of a file. SVG has the page's upper left corner as its own, in millimetres; DXF (AutoCAD 2007)
/// keeps coordinates as they are; PDF is as large as the page, its coordinates are rounded to 1/256 of a
/// point.
/// @throws bsp2::Error if cairo's module, which makes PDF, cannot be loaded.
std::string sheet_bytes(const Sheet& sheet, SheetFormat format);

/// Could `sheet_bytes` succeed? Asked before a long run. @throws bsp2::Error if not.
void check_sheet(SheetFormat format);

}  // namespace bsp2::io
