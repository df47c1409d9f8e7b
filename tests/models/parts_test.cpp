// Named parts and colours of whole models: what a run, its report and its files say of them.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "bsp2/supersteps/loop/run.hpp"

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

/// A name that no cell has is told, too.
TEST_F(NamedModels, APartWithoutCellsHasNoVolume) {
  const RunResult result =
      run("part(\"body\") difference() { cube([2, 2, 2]); part(\"inner\") cube([1, 1, 1]); }\n"
          "difference() { multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube([1, 1, 1]); "
          "part(\"cutter\") multmatrix([[1,0,0,5.5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube([1, 1, 1]); }\n"
          "part(\"hidden\") multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,1],[0,0,0,1]]) cube([1, 1, 1]);\n"
          "part(\"body\") multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube([1, 1, 1]);");
  std::map<std::string, double> volume;
  for (const auto& part : result.report.named_parts) volume[part.name] = part.volume;
  ASSERT_EQ(volume.size(), 3U);
  EXPECT_NEAR(volume["body"], 7 + 0.5, 1e-12);
  EXPECT_EQ(volume["cutter"], 0);
  EXPECT_EQ(volume["hidden"], 0);
  EXPECT_NEAR(result.report.in_volume, 8, 1e-12);
}

/// Round and flat parts through each other, in 3 and 2 dimensions.
const std::vector<std::string> mixed_models{
    "part(\"ball\") difference() { sphere(r = 2); part(\"no\") cylinder(r = 0.5, h = 9, center = true); }\n"
    "color([1, 0, 0, 0.5]) part(\"rod\") cylinder(r = 1, h = 9, center = true);\n"
    "color([0, 0, 1, 1]) { cube([5, 1, 1]); part(\"ball\") "
    "multmatrix([[1,0,0,3],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
    "sphere(r = 1); }\n"
    "intersection() { union() { part(\"left\") cube([6, 2, 0.7]); color([0, 0.5, 0, 1]) cube([7, 1.5, 0.7]); "
    "} "
    "sphere(r = 6); }",
    "part(\"disc\") circle(r = 2); difference() { part(\"plate\") square([4, 1]); color([0, 1, 0, 1]) "
    "circle(r = 1); }"};

void expect_same_parts(const RunResult& one, const RunResult& other) {
  EXPECT_EQ(one.report.digest, other.report.digest);
  EXPECT_EQ(one.report.fuzzy_cells, other.report.fuzzy_cells);
  EXPECT_EQ(one.part_names, other.part_names);
  ASSERT_EQ(one.report.named_parts.size(), other.report.named_parts.size());
  for (std::size_t i = 0; i < one.report.named_parts.size(); ++i) {
    EXPECT_EQ(one.report.named_parts[i].name, other.report.named_parts[i].name);
    EXPECT_EQ(one.report.named_parts[i].colour, other.report.named_parts[i].colour);
    EXPECT_EQ(one.report.named_parts[i].volume, other.report.named_parts[i].volume);
  }
}

TEST_F(NamedModels, AreTheSameInAnyNumberOfRegions) {
  for (const std::string& text : mixed_models)
    for (const bool curved : {false, true})
      for (const bool by_colour : {false, true}) {
        SCOPED_TRACE(testing::Message() << text << " curved " << curved << " by colour " << by_colour);
        RunOptions options;
        options.curved = curved;
        if (curved) options.tolerance = 0.3;
        options.parts_by_colour = by_colour;
        options.regions = 1;
        const RunResult whole = run(text, options);
        EXPECT_GE(whole.report.named_parts.size(), 1U);
        for (const unsigned regions : {2U, 16U, 50U}) {
          options.regions = regions;
          options.threads = regions == 16 ? 2 : 1;
          expect_same_parts(run(text, options), whole);
        }
      }
}

TEST_F(NamedModels, OutlastASnapshot) {
  for (const std::string& text : mixed_models)
    for (const bool curved : {false, true})
      for (const bool by_colour : {false, true}) {
        SCOPED_TRACE(testing::Message() << text << " curved " << curved << " by colour " << by_colour);
        RunOptions options;
        options.curved = curved;
        if (curved) options.tolerance = 0.3;
        options.parts_by_colour = by_colour;
        options.regions = 4;
        const RunResult whole = run(text, options);
        options.snapshot = folder / "snapshot.h5";
        options.cells = 10;
        static_cast<void>(run(text, options));
        RunOptions rest;
        rest.resume = options.snapshot;
        if (curved) rest.tolerance = 0.3;
        expect_same_parts(supersteps::run(rest), whole);
      }
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
  EXPECT_EQ(triangles(two_boxes), 12U);
  EXPECT_EQ(triangles(std::string("part(\"a\") {") + two_boxes + "}"), 12U);
  EXPECT_EQ(triangles(std::string("part(\"a\") ") + two_boxes), 20U);  // four sides of two faces each
}

}  // namespace
}  // namespace bsp2
