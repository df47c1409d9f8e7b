#pragma once

#include <cairo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/supersteps/state/run_result.hpp"
#include "support/sample_mesh.hpp"

namespace bsp2::supersteps {

/// Pixels 0xaarrggbb, row by row, colours multiplied by the opacity.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
  [[nodiscard]] std::uint32_t at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y * width + x)] & 0xffffff;
  }
};

/// As cairo, that is libpng, reads it.
inline Image decode(const std::string& png) {
  auto rest = std::string_view(png);
  const auto read = [](void* closure, unsigned char* data, unsigned int length) {
    auto& from = *static_cast<std::string_view*>(closure);
    if (from.size() < length) return CAIRO_STATUS_READ_ERROR;
    std::memcpy(data, from.data(), length);
    from.remove_prefix(length);
    return CAIRO_STATUS_SUCCESS;
  };
  cairo_surface_t* surface = cairo_image_surface_create_from_png_stream(read, &rest);
  EXPECT_EQ(cairo_surface_status(surface), CAIRO_STATUS_SUCCESS);
  Image image{cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface), {}};
  const unsigned char* data = cairo_image_surface_get_data(surface);
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(image.pixels.data() + static_cast<std::ptrdiff_t>(y) * image.width,
                data + static_cast<std::ptrdiff_t>(y) * cairo_image_surface_get_stride(surface),
                static_cast<std::size_t>(image.width) * 4);
  }
  cairo_surface_destroy(surface);
  return image;
}

/// A box in so many cells, which all have one look.
inline std::pair<SolidMesh, geometry::BspTree> box_of_cells(std::size_t cells) {
  std::mt19937 random(11);
  auto sample = samples::random_mesh(random, cells);
  SolidMesh mesh;
  for (const auto& batch : sample.batches) {
    auto same_look = std::make_shared<geometry::CellBatch>(*batch);
    std::fill(same_look->primitive.begin(), same_look->primitive.end(), 0);
    mesh.batches.push_back(same_look);
  }
  return {mesh, sample.tree};
}

}  // namespace bsp2::supersteps
