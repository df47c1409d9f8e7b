#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include "bsp2/bsp2.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2 {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  [[nodiscard]] fs::path at(const std::string& name) const { return folder_.path() / name; }

 private:
  samples::TemporaryFolder folder_;
};

std::string content_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

double volume_of(const SolverMesh& mesh, std::size_t tetrahedron) {
  std::array<std::array<double, 3>, 4> p;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      p[i][k] = mesh.points()[3 * mesh.tetrahedra()[4 * tetrahedron + i] + k];
  std::array<std::array<double, 3>, 3> e;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) e[i][k] = p[i + 1][k] - p[0][k];
  double volume = 0;
  for (std::size_t k = 0; k < 3; ++k)
    volume += e[0][k] * (e[1][(k + 1) % 3] * e[2][(k + 2) % 3] - e[1][(k + 2) % 3] * e[2][(k + 1) % 3]);
  return volume / 6;
}

TEST(Products, TetrahedraOfASolverMeshFillThePartsRightSideOut) {
  const char* given = std::getenv("BSP2_SEED");
  const unsigned seed = given != nullptr ? static_cast<unsigned>(std::atoi(given)) : 1;
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> length(1, 4);
  for (int round = 0; round < 3; ++round) {
    const double a = length(random), b = length(random), c = length(random), d = length(random);
    const Expression solid =
        cuboid({a, b, c}).part("first") + cuboid({d, b, c}).translate({a, 0, 0}).part("second");
    const Result result = evaluate(solid);
    const SolverMesh mesh = result.solver_mesh({.size = 1, .groups = {"left=x==min"}});
    std::map<std::string, double> volumes;
    ASSERT_EQ(mesh.volumes().size() * 4, mesh.tetrahedra().size());
    for (std::size_t i = 0; i < mesh.volumes().size(); ++i) {
      const double volume = volume_of(mesh, i);
      EXPECT_GT(volume, 0);
      volumes[mesh.volume_names().at(static_cast<std::size_t>(mesh.volumes()[i]))] += volume;
    }
    EXPECT_NEAR(volumes["first"], a * b * c, 1e-9);
    EXPECT_NEAR(volumes["second"], d * b * c, 1e-9);
    EXPECT_NEAR(mesh.volume(), result.volume().least, 1e-9);
    bool has_left = false;
    for (std::size_t i = 0; i < mesh.groups().size(); ++i)
      if (mesh.group_names().at(static_cast<std::size_t>(mesh.groups()[i])) == "left")
        for (std::size_t k = 0; k < 3; ++k) {
          has_left = true;
          EXPECT_EQ(mesh.points()[3 * mesh.triangles()[3 * i + k]], 0);
        }
    EXPECT_TRUE(has_left);
  }
}

TEST(Products, SolverMeshesAreWrittenAndMistakesTold) {
  const Folder folder;
  const SolverMesh mesh = evaluate(cube()).solver_mesh();
  mesh.write(folder.at("new/a.msh"), false, 22);
  EXPECT_EQ(content_of(folder.at("new/a.msh")).substr(0, 17), "$MeshFormat\n2.2 0");
  EXPECT_THROW(mesh.write(folder.at("a.stl")), Error);
  EXPECT_THROW(mesh.write(folder.at("case"), true), Error);
  EXPECT_THROW(mesh.write(folder.at("a.msh"), false, 3), Error);
  EXPECT_THROW(static_cast<void>(evaluate(square()).solver_mesh()), Error);
  EXPECT_THROW(static_cast<void>(evaluate(cube()).solver_mesh({.size = -1})), Error);
  EXPECT_THROW(static_cast<void>(evaluate(cube(), {.measures_only = true}).solver_mesh()), Error);
}

/// Of what is round the mesh has the true surface, and finer where it is asked for.
TEST(Products, SolverMeshesOfWhatIsRoundComeToItsSurface) {
  const std::vector<std::array<double, 4>> field{{0.8, 0, 0, 0.25}, {0, 0, 0, 0.5}, {-0.8, 0, 0, 0.5}};
  const Result result = evaluate(ball(3, 1), {.tolerance = 0.04, .size_field = field, .size = 0.5});
  const SolverMesh mesh = result.solver_mesh({.size = 0.5, .size_field = field});
  const double truth = 4 * std::numbers::pi / 3;
  EXPECT_GT(mesh.volume(), result.volume().least);
  EXPECT_LT(mesh.volume(), truth);
  EXPECT_LT(truth - mesh.volume(), (truth - result.volume().least) * 0.7);
  std::set<std::uint32_t> outer(mesh.triangles().begin(), mesh.triangles().end());
  std::size_t there = 0;
  std::array<std::size_t, 2> in_half{};
  for (const std::uint32_t p : outer) {
    const auto at = mesh.points().subspan(std::size_t{3} * p, 3);
    there += std::fabs(std::hypot(at[0], at[1], at[2]) - 1) < 1e-9 ? 1 : 0;
    ++in_half[at[0] > 0 ? 1 : 0];
  }
  EXPECT_GT(there, outer.size() * 3 / 4);
  EXPECT_GT(in_half[1], in_half[0] * 3 / 2);
}

/// Distances are rounded off for cones and stretched balls: points come to their surfaces all the same.
TEST(Products, SolverMeshesOfConesAndEllipsoidsComeToTheirSurfaces) {
  const auto expect_there = [](const Expression& solid, double size, const auto& off) {
    const SolverMesh mesh = evaluate(solid, {.tolerance = 0.05}).solver_mesh({.size = size});
    std::set<std::uint32_t> outer(mesh.triangles().begin(), mesh.triangles().end());
    std::size_t there = 0;
    for (const std::uint32_t p : outer)
      there += off(mesh.points().subspan(std::size_t{3} * p, 3)) < 1e-5 ? 1 : 0;
    EXPECT_GT(there, outer.size() * 2 / 3);
  };
  expect_there(ball(3, 1).scale({3, 1, 1.5}), 0.8, [](std::span<const double> x) {
    return std::fabs(std::hypot(x[0] / 3, x[1], x[2] / 1.5) - 1);
  });
  expect_there(cone(0.5, 2, 0), 0.8, [](std::span<const double> x) {  // its side and its lid
    return std::min(std::fabs(std::hypot(x[0], x[1]) - (2 - 4 * x[2])), std::fabs(x[2]));
  });
}

TEST(Products, DrawingsAreWrittenAndMistakesTold) {
  const Folder folder;
  const Expression block = cuboid({4, 3, 2}) - cuboid({1, 1, 9}).translate({1, 1, -1});
  draw(block, {folder.at("new/a.svg"), folder.at("new/a.dxf")}, {.sections = {"A=x:1.5"}, .title = "Block"});
  EXPECT_NE(content_of(folder.at("new/a.svg")).find("Block"), std::string::npos);
  EXPECT_NE(content_of(folder.at("new/a.dxf")).find("SECTION"), std::string::npos);
  for (const DrawingOptions& wrong :
       {DrawingOptions{.views = {"up"}}, DrawingOptions{.sections = {"A=x:7"}},
        DrawingOptions{.sections = {"A"}}, DrawingOptions{.scale = "1"}, DrawingOptions{.sheet = "B5"}}) {
    EXPECT_THROW(draw(block, {folder.at("b.svg")}, wrong), Error);
    EXPECT_FALSE(fs::exists(folder.at("b.svg")));
  }
  EXPECT_THROW(draw(block, {folder.at("b.png")}), Error);
  EXPECT_THROW(draw(square(), {folder.at("b.svg")}), Error);
}

TEST(Products, AllCellsGoIntoOneFile) {
  const Folder folder;
  evaluate(cube() + cube().translate({5, 0, 0})).write(folder.at("a.vtu"));
  EXPECT_NE(content_of(folder.at("a.vtu")).find("NumberOfCells=\"2\""), std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.at("")), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace bsp2
