#pragma once

#include <cstdint>
#include <string>

#include "bsp2/supersteps/render/picture_format.hpp"
#include "render/overlay.hpp"
#include "render/polygons.hpp"

namespace bsp2::supersteps {

/// What bsp2-cairo does.
struct CairoModule {
  static constexpr const char* name = "bsp2-cairo";
  /// The bytes of an SVG or PDF file. @param background may be null.
  std::string (*draw_vectors)(PictureFormat format, int width, int height, const Colour* background,
                              const Polygons& polygons, const Overlay& overlay);
  /// Onto an image: 0xaarrggbb, row by row, colours multiplied by the opacity.
  void (*draw_overlay)(std::uint32_t* pixels, int width, int height, const Overlay& overlay);
};

}  // namespace bsp2::supersteps
