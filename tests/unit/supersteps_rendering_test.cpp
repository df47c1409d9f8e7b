#include <cairo.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "bsp2/geometry/error.hpp"
#include "bsp2/supersteps/rendering.hpp"
#include "sample_mesh.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::CellBatch;

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
  [[nodiscard]] std::uint32_t at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y * width + x)] & 0xffffff;
  }
};

Image decode(const std::string& png) {
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

std::pair<SolidMesh, geometry::BspTree> box_of_cells(std::size_t cells) {
  std::mt19937 random(11);
  auto sample = testing::random_mesh(random, cells);
  SolidMesh mesh;
  for (const auto& batch : sample.batches) {
    auto same_part = std::make_shared<CellBatch>(*batch);
    std::fill(same_part->part.begin(), same_part->part.end(), 0);
    mesh.batches.push_back(same_part);
  }
  return {mesh, sample.tree};
}

/// Inner facets have other shades: if the order were wrong anywhere, they would show.
TEST(Rendering, CutsInsideASolidAreNotSeen) {
  const auto [whole, leaf] = box_of_cells(1);
  const auto [cells, tree] = box_of_cells(500);
  const Image expected = decode(render(whole, leaf, {.width = 300, .height = 300})), seen = decode(render(cells, tree, {.width = 300, .height = 300}));
  ASSERT_EQ(seen.width, 300);
  int different = 0;
  for (std::size_t i = 0; i < seen.pixels.size(); ++i) different += seen.pixels[i] != expected.pixels[i];
  EXPECT_LT(different, 90);  // of 90,000: where a vertex in the middle of an edge is rounded
  EXPECT_NE(expected.at(150, 150), expected.at(0, 0));
}

TEST(Rendering, ThreeSidesOfABoxHaveThreeShades) {
  const auto [whole, leaf] = box_of_cells(1);
  const Image image = decode(render(whole, leaf, {.width = 200, .height = 200}));
  std::vector<std::uint32_t> colours;
  for (const auto& [x, y] : {std::pair{100, 40}, {70, 120}, {160, 120}}) colours.push_back(image.at(x, y));
  EXPECT_NE(colours[0], colours[1]);
  EXPECT_NE(colours[1], colours[2]);
  EXPECT_GT(colours[0] & 0xff, colours[2] & 0xff);  // the top is lit, the right side is not
}

TEST(Rendering, DrawsThePlaneAndOnlyInCells) {
  std::mt19937 random(1);
  auto batch = std::make_shared<CellBatch>();
  testing::append_polygon(*batch, {{0, 0}, {2, 0}, {2, 2}, {0, 2}}, random);
  testing::append_polygon(*batch, {{2, 0}, {4, 0}, {4, 2}, {2, 2}}, random);
  testing::append_polygon(*batch, {{0, 2}, {4, 2}, {4, 4}, {0, 4}}, random);
  batch->label[2] = geometry::Label::out;
  batch->part[1] = 1;
  SolidMesh mesh{2, {batch}};
  const geometry::BspTree tree{2, 0, {{0, 1, ~3}, {1, ~1, ~2}}, {}, {-2, 0, 1, -2, 1, 0}};  // y = 2, below it x = 2
  const Image image = decode(render(mesh, tree, {.width = 100, .height = 100}));
  EXPECT_NE(image.at(25, 50), image.at(0, 0));
  EXPECT_NE(image.at(75, 50), image.at(25, 50));
  EXPECT_EQ(image.at(50, 10), image.at(0, 0));
}

TEST(Rendering, AnEmptySolidIsAnEmptyImageAndFourDimensionsAreRefused) {
  const Image image = decode(render(SolidMesh{}, {}, {.width = 10, .height = 10}));
  EXPECT_EQ(image.at(5, 5), image.at(0, 0));
  EXPECT_THROW(render(SolidMesh{.dimension = 4}, {}), Error);
}

}  // namespace
}  // namespace bsp2::supersteps
