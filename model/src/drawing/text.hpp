#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace bsp2::model {

struct TextStyle {
  double size = 10, spacing = 1;
  std::string font;  ///< a fontconfig pattern; empty: Liberation Sans
  std::string direction = "ltr", language = "en", script, horizontal = "left", vertical = "baseline";
  std::uint32_t segments = 2;  ///< of each Bezier curve
};

/// Closed paths of one glyph about its own origin, one after the other.
struct GlyphOutline {
  std::vector<std::array<double, 2>> points;
  std::vector<std::uint32_t> path_lengths;
};

struct TextOutlines {
  struct Placed {
    std::uint32_t glyph;  ///< an index into `glyphs`
    std::array<double, 2> at;
  };
  std::vector<GlyphOutline> glyphs;  ///< each once, however often the text has it
  std::vector<Placed> placed;        ///< in the order of the text; blanks are left out
};

/// The outlines of a text: the font that fontconfig finds, shaped by HarfBuzz, hinted and drawn by FreeType,
/// in the sizes of OpenSCAD 2021.01: an em is 100/72 of `size`; advances and alignment are 1000/1024 of what
/// goes with the outlines.
///
/// Any thread, one at a time each. @param warn is called where another font than the one asked for is used.
/// @throws bsp2::Error if there is no font at all.
TextOutlines text_outlines(const std::string& text, const TextStyle& style,
                           const std::function<void(std::string)>& warn);

}  // namespace bsp2::model
