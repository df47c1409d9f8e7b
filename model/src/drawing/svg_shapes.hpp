#pragma once

#include <libxml/tree.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

/// The shapes of Scalable Vector Graphics 1.1, as far as OpenSCAD 2021.01 reads them; curves have 20 chords,
/// circles 40 sides.
namespace bsp2::model::svg {

using Point = std::array<double, 2>;

/// An attribute's text; empty if there is none.
std::string attribute(const xmlNode* node, const char* name);

/// All numbers at the beginning of a text.
std::vector<double> numbers_of(const std::string& text);

/// A number and its unit.
struct Length {
  double number = 0;
  std::string unit;
};

/// Nothing if the text is no length.
std::optional<Length> read_length(const std::string& text);

/// Millimetres in a unit; 0 for those that are a share of something else.
double millimetres_in(const std::string& unit, double dpi);

/// A length in the drawing's own units, which are pixels; 0 if it is none.
double user_units(const std::string& text);

/// Where a shape stands: the width and height that its lengths in per cent are shares of.
struct Viewport {
  Point size{};
  /// A length's share of the viewport, as the standard has it: along x, along y, or in between.
  [[nodiscard]] double share(char axis) const;
};

/// The paths of an element, and what is wrong with it, to follow its name: "path with ..."; empty if nothing
/// is.
struct Shape {
  std::vector<std::vector<Point>> paths;
  std::string fault{};
};

/// An element that is a shape, in its own frame. A shape with a length that cannot be read has no paths, a
/// path or polygon those up to what is damaged in it.
Shape shape_of(const xmlNode* node, const std::string& name, const Viewport& viewport);

/// A length of an element; nothing if it says none. @param fault gets what is wrong with it.
std::optional<double> length_of(const std::string& text, char axis, const Viewport& viewport,
                                std::string& fault);

}  // namespace bsp2::model::svg
