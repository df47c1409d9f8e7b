#pragma once

#include "render/canvas.hpp"

namespace bsp2::supersteps {

/// What bsp2-cairo does.
struct CairoModule {
  static constexpr const char* name = "bsp2-cairo";
  std::unique_ptr<Canvas> (*new_canvas)(int width, int height);
  /// The bytes of an SVG or PDF file.
  std::string (*draw_vectors)(PictureFormat format, int width, int height, const Colour& background,
                              const Drawing::Layer& polygons);
};

}  // namespace bsp2::supersteps
