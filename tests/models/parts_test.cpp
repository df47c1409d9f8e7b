// Named parts and colours of whole models: what a run, its report and its files say of them.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "bsp2/supersteps/run.hpp"

namespace bsp2 {
namespace {

namespace fs = std::filesystem;
using supersteps::RunOptions;
using supersteps::RunResult;

std::string case_text(const char* name) {
  std::ifstream in(fs::path(BSP2_SOURCE_DIR) / "tests" / "cases" / name);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

class NamedModels : public ::testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("bsp2_parts_" + std::to_string(::getpid()));
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }

  [[nodiscard]] RunResult run(const std::string& text, RunOptions options = {}) const {
    options.model = folder / "model.csg";
    std::ofstream(options.model) << text;
    return supersteps::run(options);
  }

  /// The name of the part at a point.
  static std::string part_at(const RunResult& result) {
    const std::int32_t part = result.answers.at(0).part;
    return part < 0 ? "" : result.part_names.at(static_cast<std::size_t>(part));
  }
};

std::string swapped_lines(const std::string& text) {
  const std::size_t end = text.find('\n');
  return text.substr(end + 1) + '\n' + text.substr(0, end);
}

/// The post stands in a recess of the base, whose box has it too; below the recess the base wins where it
/// comes first.
TEST_F(NamedModels, APartStandsInTheRecessOfAnother) {
  const std::string text = case_text("part-in-recess.csg");
  ASSERT_FALSE(text.empty());
  for (const bool swapped : {false, true})
    for (const unsigned regions : {1U, 20U}) {
      RunOptions options;
      options.regions = regions;
      options.points = {10, 10, 13};
      const RunResult result = run(swapped ? swapped_lines(text) : text, options);
      EXPECT_EQ(part_at(result), "post") << regions;
      ASSERT_EQ(result.report.named_parts.size(), 2U);
      EXPECT_EQ(result.report.named_parts[0].name, swapped ? "post" : "base");
      double sum = 0;
      for (const auto& part : result.report.named_parts) sum += part.volume;
      EXPECT_NEAR(sum, result.report.in_volume, 1e-9 * result.report.in_volume);
      options.points = {10, 10, 3};
      EXPECT_EQ(part_at(run(swapped ? swapped_lines(text) : text, options)), swapped ? "post" : "base");
    }
}

TEST_F(NamedModels, TheWholeIsPartZeroWhereNothingHasAName) {
  RunOptions options;
  options.points = {0.5, 0.5, 0.5};
  const RunResult result = run("cube([1, 1, 1]); color(\"red\") cube([3, 1, 1]);", options);
  EXPECT_EQ(result.answers.at(0).part, 0);
  EXPECT_EQ(result.answers.at(0).primitive, 0);
  EXPECT_TRUE(result.part_names.empty());
  EXPECT_TRUE(result.report.named_parts.empty());
}

/// Colours as OpenSCAD writes them; of nested ones the outermost counts, and one colour is one part.
TEST_F(NamedModels, ColoursMayBeParts) {
  RunOptions options;
  options.parts_by_colour = true;
  const RunResult result =
      run("color([1, 0, 0, 1]) { cube([1, 1, 1]); color([0, 0, 1, 1]) cube([2, 1, 1]); }\n"
          "color([0.2, 0.4, 0.6, 0.5]) cube([4, 1, 1]);\n"
          "color(\"red\") multmatrix([[1,0,0,3],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube([3, 1, 1]);\n"
          "multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube([2, 1, 1]);",
          options);
  const auto& parts = result.report.named_parts;
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].name, "red");
  EXPECT_NEAR(parts[0].volume, 2 + 2, 1e-12);
  EXPECT_EQ(parts[0].colour, (supersteps::Rgba{255, 0, 0, 255}));
  EXPECT_EQ(parts[1].name, "#33669980");
  EXPECT_NEAR(parts[1].volume, 2, 1e-12);
  EXPECT_NEAR(result.report.in_volume, 7, 1e-12);
}

/// What is made of several operands has the name of the first one, unless there is one around it.
TEST_F(NamedModels, ConstructsHaveANameToo) {
  const RunResult result =
      run("hull() { part(\"a\") cube([1, 1, 1]); part(\"b\") cube([2, 1, 1]); }\n"
          "multmatrix([[1,0,0,3],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) part(\"c\") linear_extrude(height = 2) "
          "part(\"d\") square([1, 1]);");
  ASSERT_EQ(result.report.named_parts.size(), 2U);
  EXPECT_EQ(result.report.named_parts[0].name, "a");
  EXPECT_NEAR(result.report.named_parts[0].volume, 2, 1e-12);
  EXPECT_EQ(result.report.named_parts[1].name, "c");
  EXPECT_NEAR(result.report.named_parts[1].volume, 2, 1e-12);
}

/// Without names no cut is made for them, and a cell in which a red post and a grey block meet is not given
/// back as one of either.
TEST_F(NamedModels, APostHasItsColourInTheRecessOfABlock) {
  RunOptions options;
  options.points = {10, 10, 13};
  std::string text = case_text("part-in-recess.csg");
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("part(name=\"base\")", "color(\"grey\")");
  replace("part(name=\"post\")", "color(\"red\")");
  const RunResult result = run(text, options);
  const auto& colour =
      result.colour_of_primitive.at(static_cast<std::size_t>(result.answers.at(0).primitive));
  EXPECT_EQ(colour, (supersteps::Rgba{255, 0, 0, 255}));
  for (const auto& batch : result.mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      EXPECT_NE(batch->primitive[cell], geometry::no_primitive);
}

/// A face of the surface ends where the part does, and not where the primitive does.
TEST_F(NamedModels, FacesAreMergedWithinAPart) {
  RunOptions options;
  options.boundary = true;
  const char* const two_boxes =
      "cube([1, 1, 1]); multmatrix([[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube([1, 1, 1]);";
  const auto triangles = [&](const std::string& text) {
    return run(text, options).boundary->triangles.size();
  };
  EXPECT_EQ(triangles(two_boxes), 20U);  // four sides of two faces each
  EXPECT_EQ(triangles(std::string("part(\"a\") {") + two_boxes + "}"), 12U);
}

}  // namespace
}  // namespace bsp2
