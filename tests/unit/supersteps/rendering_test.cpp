#include "bsp2/supersteps/render/rendering.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/error.hpp"
#include "supersteps/images.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::CellBatch;

/// Inner facets have other shades: if the order were wrong anywhere, they would show.
TEST(Rendering, CutsInsideASolidAreNotSeen) {
  const auto [whole, leaf] = box_of_cells(1);
  const auto [cells, tree] = box_of_cells(500);
  const Image expected = decode(render(whole, leaf, {.width = 300, .height = 300})),
              seen = decode(render(cells, tree, {.width = 300, .height = 300}));
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
  samples::append_polygon(*batch, {{0, 0}, {2, 0}, {2, 2}, {0, 2}}, random);
  samples::append_polygon(*batch, {{2, 0}, {4, 0}, {4, 2}, {2, 2}}, random);
  samples::append_polygon(*batch, {{0, 2}, {4, 2}, {4, 4}, {0, 4}}, random);
  batch->label[2] = geometry::Label::out;
  batch->primitive[1] = 1;
  SolidMesh mesh{2, {batch}};
  const geometry::BspTree tree{
      2, 0, {{0, 1, ~3}, {1, ~1, ~2}}, {}, {-2, 0, 1, -2, 1, 0}};  // y = 2, below it x = 2
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

/// However it is divided into cells, and wherever it is cut: the section hides what is behind it.
TEST(Rendering, SectionsAreFilled) {
  const auto [whole, leaf] = box_of_cells(1);
  const auto [cells, tree] = box_of_cells(500);
  std::mt19937 random(5);
  for (int round = 0; round < 12; ++round) {
    PictureOptions options{.width = 200, .height = 200, .ball = 1};
    options.section = {round % 3, 0.5 + static_cast<double>(random() % 9), round % 2 == 0};
    options.turn = static_cast<double>(random() % 360);
    const Image expected = decode(render(whole, leaf, options)), seen = decode(render(cells, tree, options));
    int different = 0, covered = 0;
    for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
      different += seen.pixels[i] != expected.pixels[i];
      covered += expected.pixels[i] != expected.pixels[0];
    }
    EXPECT_GT(covered, 400) << round;
    EXPECT_LT(different, 80) << round;
    options.section.reset();
    EXPECT_NE(decode(render(whole, leaf, options)).pixels, expected.pixels) << round;
  }
  // Nothing is left, or all; what only touches the section is not.
  PictureOptions end{.width = 50, .height = 50, .section = PictureSection{0, 10, true}};
  EXPECT_EQ(decode(render(cells, tree, end)).pixels,
            std::vector<std::uint32_t>(2500, decode(render(cells, tree, end)).pixels[0]));
  PictureOptions none{.width = 50, .height = 50, .section = PictureSection{0, 10.5, true}};
  const Image empty = decode(render(cells, tree, none));
  EXPECT_EQ(std::count(empty.pixels.begin(), empty.pixels.end(), empty.pixels[0]), 2500);
  none.section->keeps_upper = false;
  EXPECT_EQ(decode(render(cells, tree, none)).pixels,
            decode(render(cells, tree, {.width = 50, .height = 50})).pixels);
}

TEST(Rendering, AQuarterTurnShowsTheNextSide) {
  // A box that looks the same from its four sides, but for the light; the scale stays.
  const auto [whole, leaf] = box_of_cells(1);
  const auto silhouette = [&](double turn, std::optional<std::array<double, 3>> eye) {
    PictureOptions options{.width = 150, .height = 150, .eye = eye, .turn = turn, .ball = 1};
    const Image image = decode(render(whole, leaf, options));
    int covered = 0;
    for (const std::uint32_t pixel : image.pixels) covered += pixel != image.pixels[0];
    return covered;
  };
  const std::optional<std::array<double, 3>> eyes[] = {{}, std::array{30.0, -20.0, 15.0}};
  for (const auto& eye : eyes) {
    const int first = silhouette(0, eye);
    EXPECT_GT(first, 1000);
    EXPECT_NEAR(silhouette(90, eye), first, 0.02 * first);
    EXPECT_NEAR(silhouette(270, eye), first, 0.02 * first);
    EXPECT_GT(std::abs(silhouette(eye ? 10 : 15, eye) - first), 0.005 * first);
  }
}

/// Two unit cubes beside each other along x, each a region of its own.
RunResult two_cubes() {
  auto batch = std::make_shared<CellBatch>();
  for (const std::uint32_t region : {0U, 1U}) {
    const double x = region;
    for (int corner = 0; corner < 8; ++corner)
      batch->points.insert(batch->points.end(), {x + (corner & 1), static_cast<double>(corner >> 1 & 1),
                                                 static_cast<double>(corner >> 2)});
    for (const auto& facet : std::vector<std::vector<std::uint16_t>>{
             {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
      batch->facet_vertices.insert(batch->facet_vertices.end(), facet.begin(), facet.end());
      batch->facet_vertex_offset.push_back(static_cast<std::uint32_t>(batch->facet_vertices.size()));
    }
    // The facet between them is on hyperplane 100, from both sides.
    const auto own = static_cast<std::int32_t>(10 * region);
    batch->facet_hyperplane.insert(
        batch->facet_hyperplane.end(),
        {region == 1 ? ~100 : own, region == 0 ? 100 : own + 1, own + 2, own + 3, own + 4, own + 5});
    batch->point_offset.push_back(8 * (region + 1));
    batch->facet_offset.push_back(6 * (region + 1));
    batch->label.push_back(geometry::Label::in);
    batch->primitive.push_back(static_cast<std::int32_t>(region));
    batch->part.push_back(0);
    batch->region.push_back(region);
    batch->level.push_back(1);
    batch->volume.push_back(1);
  }
  RunResult result;
  result.mesh = {3, {batch}};
  result.tree = result.partition = {3, 0, {{0, ~1, ~2}}, {}, {-1, 1, 0, 0}};
  result.rank_of_region = {0, 0};
  return result;
}

Image drawn(const RunResult& result, const PictureOptions& options) {
  Ranks alone;
  return decode(render(alone, result, options));
}

/// From the left end to the right, the colours of a row of pixels without repetitions.
std::vector<std::uint32_t> row_of(const Image& image, int y) {
  std::vector<std::uint32_t> colours;
  for (int x = 0; x < image.width; ++x)
    if (colours.empty() || colours.back() != image.at(x, y)) colours.push_back(image.at(x, y));
  return colours;
}

PictureOptions from_the_front(double eye_y = -1000) {
  PictureOptions options;
  options.width = 200;
  options.height = 100;
  options.eye = {1, eye_y, 0.5};
  options.look = {1, 0, 0.5};
  options.shade = Shade::region;
  return options;
}

TEST(Rendering, ExplodingMovesRegionsApart) {
  const RunResult cubes = two_cubes();
  PictureOptions options = from_the_front();
  const auto together = row_of(drawn(cubes, options), 50);
  ASSERT_EQ(together.size(), 4U);  // nothing, one, the other, nothing
  EXPECT_NE(together[1], together[2]);
  options.explode = 1;
  const auto apart = row_of(drawn(cubes, options), 50);
  // Between them is nothing; there may be a shade at their edges.
  EXPECT_GE(apart.size(), 5U);
  EXPECT_NE(std::find(apart.begin() + 1, apart.end() - 1, apart[0]), apart.end() - 1);
  EXPECT_NE(std::find(apart.begin(), apart.end(), together[1]), apart.end());
  EXPECT_NE(std::find(apart.begin(), apart.end(), together[2]), apart.end());
}

TEST(Rendering, AnEyeSeesWhatIsNearerInFront) {
  const RunResult cubes = two_cubes();
  PictureOptions options = from_the_front();
  options.look = {0.5, 0.5, 0.5};
  const auto centre = [&](double x) {
    options.eye = {x, 0.5, 0.5};
    const Image image = drawn(cubes, options);
    return image.at(100, 50);
  };
  const std::uint32_t from_left = centre(-8), from_right = centre(10);
  EXPECT_NE(from_left, from_right);
  options.explode = 0.5;
  EXPECT_EQ(centre(-8), from_left);
  options.look = {1.5, 0.5, 0.5};
  EXPECT_EQ(centre(10), from_right);
  options.eye = options.look;
  Ranks alone;
  EXPECT_THROW(render(alone, cubes, options), Error);
}

TEST(Rendering, FuzzyCellsAreTranslucentAndOutCellsAreNotDrawn) {
  RunResult cubes = two_cubes();
  auto batch = std::make_shared<CellBatch>(*cubes.mesh.batches[0]);
  cubes.mesh.batches[0] = batch;
  PictureOptions options = from_the_front();
  options.shade = Shade::label;
  options.look = {0.5, 0.5, 0.5};
  options.eye = {-8, 0.5, 0.5};  // the first cube hides the second one
  const std::uint32_t opaque = drawn(cubes, options).at(100, 50);
  batch->label[0] = geometry::Label::fuzzy;
  const std::uint32_t mixed = drawn(cubes, options).at(100, 50);
  EXPECT_NE(mixed, opaque);
  batch->label[1] = geometry::Label::out;
  const Image alone = drawn(cubes, options);
  EXPECT_NE(alone.at(100, 50), mixed);  // less of it behind
  EXPECT_NE(alone.at(100, 50), alone.at(0, 0));
}

TEST(Rendering, ColoursEdgesAndShadesShow) {
  RunResult cubes = two_cubes();
  PictureOptions options = from_the_front();
  options.shade = Shade::rank;
  EXPECT_EQ(row_of(drawn(cubes, options), 50).size(), 3U);  // one rank computed both
  options.edges = Edges::cells;
  EXPECT_GT(row_of(drawn(cubes, options), 50).size(), 5U);
  options.edges = Edges::none;
  options.shade = Shade::colour;
  cubes.colour_of_primitive = {Rgba{0, 0, 255, 255}, Rgba{255, 0, 0, 255}};
  const auto row = row_of(drawn(cubes, options), 50);
  ASSERT_EQ(row.size(), 4U);
  EXPECT_EQ(row[1] & 0xffff00, 0U);  // blue
  EXPECT_EQ(row[2] & 0x00ffff, 0U);  // red
  EXPECT_NE(row[1], 0U);
}

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t times = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++times;
  return times;
}

TEST(Rendering, WritesVectorsWithoutHiddenFacets) {
  RunResult cubes = two_cubes();
  PictureOptions options;
  options.format = PictureFormat::svg;
  Ranks alone;
  const std::string two = render(alone, cubes, options);
  EXPECT_EQ(two.rfind("<?xml", 0), 0U);
  auto batch = std::make_shared<CellBatch>(*cubes.mesh.batches[0]);
  batch->region = {0, 0};  // within a region, what two cells share is left out
  cubes.mesh.batches[0] = batch;
  cubes.partition = {};
  const std::string one = render(alone, cubes, options);
  // The viewer is at the front, right and above: three facets of each cube show their front.
  EXPECT_EQ(count(two, "stroke-width"), 6U);
  EXPECT_EQ(count(one, "stroke-width"), 5U);
  options.format = PictureFormat::pdf;
  const std::string pdf = render(alone, cubes, options);
  EXPECT_EQ(pdf.rfind("%PDF", 0), 0U);
  EXPECT_EQ(pdf.find("/CreationDate"), std::string::npos) << "it is another file a second later";
}

}  // namespace
}  // namespace bsp2::supersteps
