// Inputs of tests/cases whose right value is in what the program writes or says, each with that of cases.tsv.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "models.hpp"
#include "support/command.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;

samples::Ended start(const std::string& arguments) {
  return samples::run_command(BSP2_PROGRAM " " + arguments);
}

bool has_openscad() { return std::system("command -v openscad > /dev/null 2>&1") == 0; }

using Corner = std::array<float, 3>;

/// The triangles of a binary STL file.
std::vector<std::array<Corner, 3>> triangles_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::vector<std::array<Corner, 3>> triangles;
  constexpr std::size_t head = 84, facet = 50, normal = 12;
  for (std::size_t at = head; at + facet <= bytes.size(); at += facet)
    std::memcpy(triangles.emplace_back().data(), bytes.data() + at + normal, 36);
  return triangles;
}

TEST(ProgramCases, RoofsHaveNoSliversInStl) {
  const samples::TemporaryFolder folder;
  const fs::path stl = folder.path() / "roof.stl", report = folder.path() / "report.json";
  const samples::Ended ended =
      start("run " + (cases() / "roof-slivers.csg").string() + " --threads 2 --boundary " + stl.string() +
            " --report " + report.string());
  ASSERT_EQ(ended.code, 0) << ended.text;
  std::ifstream written(report);
  const double volume = nlohmann::json::parse(written).at("volume").at("in").get<double>();
  EXPECT_NEAR(volume, 66806.5348106, 1e-6);
  std::map<std::pair<Corner, Corner>, int> edges;
  double under = 0;
  for (const auto& t : triangles_of(stl)) {
    std::array<std::array<double, 3>, 3> p;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) p[i][k] = static_cast<double>(t[i][k]);
    double area = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      const double n = (p[1][l] - p[0][l]) * (p[2][m] - p[0][m]) - (p[1][m] - p[0][m]) * (p[2][l] - p[0][l]);
      area += n * n;
      under += p[0][k] * n / 6;
    }
    EXPECT_GT(area, 0);
    for (std::size_t i = 0; i < 3; ++i) {
      const Corner &a = t[i], &b = t[(i + 1) % 3];
      edges[a < b ? std::pair(a, b) : std::pair(b, a)] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, balance] : edges) EXPECT_EQ(balance, 0);
  EXPECT_NEAR(under, volume, 1e-5 * volume);
}

TEST(ProgramCases, MissingLibrariesAreNamed) {
  if (!has_openscad()) GTEST_SKIP() << "openscad is not installed";
  const samples::Ended ended = start("run " + (cases() / "missing-library.scad").string());
  EXPECT_EQ(ended.code, 2) << ended.text;
  EXPECT_NE(ended.text.find("BOSL2/std.scad"), std::string::npos) << ended.text;
}

TEST(ProgramCases, NoTetrahedronIsInverted) {
  if (!has_openscad()) GTEST_SKIP() << "openscad is not installed";
  const samples::TemporaryFolder folder;
  const samples::Ended ended = start("run " + (cases() / "inverted-tets.scad").string() +
                                     " --threads 2 --tets -o " + folder.path().string());
  ASSERT_EQ(ended.code, 0) << ended.text;
  std::ifstream written(folder.path() / "report.json");
  const auto simplices = nlohmann::json::parse(written).at("simplices");
  EXPECT_GT(simplices.at("count").get<std::uint64_t>(), 25'000U);
  EXPECT_GT(simplices.at("smallest_angle").get<double>(), 0);
  EXPECT_LT(simplices.at("left_out_volume").get<double>(), 1e-9);
}

}  // namespace
}  // namespace bsp2::models
