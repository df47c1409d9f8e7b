// Models that take a while.

#include <gtest/gtest.h>

#include <ctime>

#include "models.hpp"

namespace bsp2::models {
namespace {

TEST(HeavyModel, AnIcosphereOf80000Triangles) {
  const std::clock_t start = std::clock();  // of the processor: the machine may be busy
  const Ball ball = icosphere(6);
  ASSERT_EQ(ball.faces.size(), 81920U);
  const Expression mesh = model::polyhedron(ball.points, ball.faces);
  const double volume = skin_volume(ball);
  EXPECT_NEAR(evaluate(mesh).volume(), volume, 1e-9 * volume);
  // Cut in two: each half is a half by symmetry.
  const Expression half = model::intersect({mesh, move(-2, -2, 0, model::cuboid({4, 4, 4}))});
  EXPECT_NEAR(evaluate(half).volume(), volume / 2, 1e-9 * volume);
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 300);
}

TEST(HeavyModel, MengerSpongeOfLevel3) { EXPECT_NEAR(evaluate(menger(3)).volume(), 8000, 1e-9); }

TEST(HeavyModel, ManyCubesTurnedAboutTheirCommonAxis) {
  for (const int n : {90, 180, 360}) {
    std::vector<Expression> cubes;
    for (int k = 0; k < n; ++k) cubes.push_back(turn(std::numbers::pi / 2 * k / n, cube(1, true)));
    const double low = std::numbers::pi / 4 * (1 - 1.0 / n), high = std::numbers::pi / 4;
    const double area = n * (std::tan(high) - std::tan(low));  // see degenerate_test.cpp
    const Solid united = evaluate(model::unite(cubes));
    EXPECT_NEAR(united.volume(), area, 1e-8) << n << " cubes";
    EXPECT_LE(united.cells(), 5 * std::pow(n, 1.5)) << n << " cubes";
  }
}

/// The generator's towers: volumes from an independent evaluation.
TEST(HeavyModel, TowersOfTheGenerator) {
  const auto generator = shared() / "models" / "leaning_tower.py";
  if (shared().empty() || !std::filesystem::exists(generator)) GTEST_SKIP() << "no generator at hand";
  const auto file = std::filesystem::temp_directory_path() /
                    ("bsp2_tower_" + std::to_string(std::random_device{}()) + ".csg");
  struct Tower {
    const char* options;
    double volume;
  };
  for (const auto& [options, volume] : {Tower{"16 --dyadic", 4992.14352895},
                                        {"32 --dyadic", 5019.6277262},
                                        {"64 --dyadic", 5026.50821216},
                                        {"16", 4991.35582011},
                                        {"32", 5018.83336011},
                                        {"64", 5025.71220765}}) {
    const std::string command =
        "python3 '" + generator.string() + "' " + options + " > '" + file.string() + "'";
    ASSERT_EQ(std::system(command.c_str()), 0);
    const auto report = run_file(file);
    EXPECT_NEAR(report.in_volume, volume, 1e-9 * volume) << options;
    EXPECT_EQ(report.fuzzy_cells, 0U) << options;
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace bsp2::models
