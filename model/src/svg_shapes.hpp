#pragma once

#include <libxml/tree.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

/// The shapes of Scalable Vector Graphics 1.1, as far as OpenSCAD 2021.01 reads them; curves have 20 chords, circles 40 sides.
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

/// The paths of an element that is a shape, in its own frame.
std::vector<std::vector<Point>> shape_of(const xmlNode* node, const std::string& name);

}  // namespace bsp2::model::svg
