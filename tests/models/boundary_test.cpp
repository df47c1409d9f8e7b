// Boundaries of real models: closed, and around the volume of their cells.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "models.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

supersteps::RunResult run_with_boundary(const std::filesystem::path& file, unsigned regions = 1) {
  supersteps::RunOptions options;
  options.model = file;
  options.threads = 2;
  options.regions = regions;
  options.boundary = true;
  return supersteps::run(options);
}

void expect_closed(const supersteps::RunResult& result) {
  ASSERT_TRUE(result.report.boundary && result.boundary);
  EXPECT_TRUE(result.report.boundary->closed);
  EXPECT_EQ(result.report.boundary->triangles, result.boundary->triangles.size());
  EXPECT_NEAR(result.boundary->volume(), result.report.in_volume, 1e-9 * result.report.in_volume);
  EXPECT_EQ(result.report.supersteps.back().name, "resolution");
}

/// Expects the surface that is found without cells to be that of the cells, byte for byte. @return whether
/// none were made.
bool expect_same_without_cells(const std::filesystem::path& file, const supersteps::RunResult& of_cells) {
  supersteps::RunOptions options;
  options.model = file;
  options.threads = 2;
  options.boundary = options.surface_only = true;
  const auto result = supersteps::run(options);
  EXPECT_TRUE(result.report.boundary && of_cells.report.boundary);
  if (!result.report.boundary || !of_cells.report.boundary) return false;
  EXPECT_EQ(result.report.boundary->digest, of_cells.report.boundary->digest);
  EXPECT_NEAR(result.report.in_volume, of_cells.report.in_volume, 1e-11 * of_cells.report.in_volume);
  EXPECT_EQ(result.report.lower.size(), of_cells.report.lower.size());
  for (std::size_t k = 0; k < result.report.lower.size(); ++k) {
    const double size = of_cells.report.upper[k] - of_cells.report.lower[k];
    EXPECT_NEAR(result.report.lower[k], of_cells.report.lower[k], 1e-9 * size);
    EXPECT_NEAR(result.report.upper[k], of_cells.report.upper[k], 1e-9 * size);
  }
  return !result.report.has_cells;
}

TEST(Boundary, OfTheExamples) {
  // The tower's area is what mesh kernels find.
  const auto folder = std::filesystem::path(BSP2_SOURCE_DIR) / "examples";
  const auto tower = run_with_boundary(folder / "leaning_tower.csg");
  expect_closed(tower);
  EXPECT_NEAR(tower.report.boundary->area, 9619.266, 1e-3);
  EXPECT_TRUE(expect_same_without_cells(folder / "leaning_tower.csg", tower));
  const auto in_regions = run_with_boundary(folder / "leaning_tower.csg", 16);
  expect_closed(in_regions);
  EXPECT_NEAR(in_regions.report.boundary->area, tower.report.boundary->area,
              1e-9 * tower.report.boundary->area);
  for (const char* name : {"mechanical_piece.csg", "menger_sponge.csg", "every_node.csg", "polyhedra.csg",
                           "touching_solids.csg"}) {
    SCOPED_TRACE(name);
    const auto result = run_with_boundary(folder / name);
    expect_closed(result);
    expect_same_without_cells(folder / name, result);
  }
}

TEST(Boundary, OfTheFuzzyIsThatOfTheInCells) {
  supersteps::RunOptions options;
  options.model = std::filesystem::path(BSP2_SOURCE_DIR) / "examples" / "leaning_tower.csg";
  options.level = 24;
  options.boundary = options.contacts = true;
  const auto result = supersteps::run(options);
  EXPECT_GT(result.report.fuzzy_cells, 0U);
  EXPECT_GT(result.report.in_cells, 0U);
  EXPECT_GT(result.contacts.size(), 0U);
  expect_closed(result);
}

TEST(Boundary, OfTheCorpus) {
  const auto folder = shared() / "corpus" / "csg";
  std::ifstream manifest(folder / "manifest.tsv");
  if (shared().empty() || !manifest) GTEST_SKIP() << "no corpus at hand";
  std::map<std::string, std::size_t> column;
  std::size_t checked = 0, without_cells = 0;
  for (std::string line; std::getline(manifest, line);) {
    std::vector<std::string> words;
    std::istringstream stream(line);
    for (std::string word; std::getline(stream, word, '\t');) words.push_back(word);
    words.resize(40);
    if (column.empty()) {
      for (std::size_t i = 0; i < words.size(); ++i) column.try_emplace(words[i], i);
      continue;
    }
    if (words[column["level"]] != "0") continue;
    SCOPED_TRACE(words[column["file"]]);
    const auto result = run_with_boundary(folder / words[column["file"]]);
    expect_closed(result);
    without_cells += expect_same_without_cells(folder / words[column["file"]], result);
    ++checked;
  }
  EXPECT_GT(checked, 50U);
  EXPECT_GT(without_cells, 30U);
}

/// ParaView opens what is written, if its checker is at hand and asked for by BSP2_PARAVIEW: it takes a
/// while.
TEST(Boundary, OpensInParaView) {
  const auto checker = shared() / "tools" / "paraview-check";
  if (shared().empty() || std::getenv("BSP2_PARAVIEW") == nullptr) GTEST_SKIP() << "not asked for";
  const samples::TemporaryFolder folder;
  const auto model = std::filesystem::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  for (const char* name : {"b.vtp", "b.stl", "b.ply", "b.obj"}) {
    const std::string file = (folder.path() / name).string();
    EXPECT_EQ(
        std::system(
            (std::string(BSP2_PROGRAM) + " run --quiet " + model.string() + " --boundary " + file).c_str()),
        0);
    EXPECT_EQ(std::system((checker.string() + " " + file).c_str()), 0) << name;
  }
}

}  // namespace
}  // namespace bsp2::models
