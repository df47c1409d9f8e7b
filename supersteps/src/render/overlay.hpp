#pragma once

#include <string>
#include <vector>

#include "pixels/colour.hpp"
#include "render/camera.hpp"

namespace bsp2::supersteps {

/// What is written on a picture: boxes, then lines, then texts. Pixels, from the upper left corner.
struct Overlay {
  struct Box {
    Point2 low{}, high{};
    Colour colour{};
    double opacity = 1;
  };
  struct Line {
    Point2 from{}, to{};
    Colour colour{};
    double width = 1;
  };
  struct Text {
    Point2 at{};  ///< on the line that letters stand on
    std::string words;
    double size = 12;
    double align = 0;  ///< which share of it is on the left of the place
    Colour colour{};
  };
  std::vector<Box> boxes;
  std::vector<Line> lines;
  std::vector<Text> texts;
  [[nodiscard]] bool is_empty() const { return boxes.empty() && lines.empty() && texts.empty(); }
};

}  // namespace bsp2::supersteps
