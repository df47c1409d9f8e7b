// Landscapes and other meshes with very many facets that are nearly in one plane: what they cost, counted.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include "models.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

/// What the kernel has to do: exact answers cost far more than others.
double work_of(const supersteps::RunReport& report) {
  return static_cast<double>(report.splits) + 0.1 * static_cast<double>(report.predicates) +
         2 * static_cast<double>(report.exact_fallbacks);
}

class Landscapes : public testing::Test {
 protected:
  void SetUp() override {
    if (samples::is_sanitized) GTEST_SKIP() << "what it does is counted, the same in any build";
  }
  /// @param number prints a height.
  template <typename Height>
  supersteps::RunReport report_of(int width, int height, double coincidence, Height&& number) {
    std::ofstream table(folder_.path() / "heights.dat");
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) table << number(x, y) << (x + 1 < width ? " " : "\n");
    table.close();
    std::ofstream(folder_.path() / "model.csg")
        << "multmatrix([[0.5,0,0,0],[0,0.5,0,0],[0,0,0.05,0],[0,0,0,1]])"
           "{surface(file=\"heights.dat\",center=true);}";
    return report_of_file(folder_.path() / "model.csg", coincidence);
  }
  static supersteps::RunReport report_of_file(const std::filesystem::path& file, double coincidence) {
    supersteps::RunOptions options;
    options.model = file;
    options.threads = 2;
    options.coincidence = coincidence;
    return supersteps::run(options).report;
  }
  /// Hills of whole grey values; long before they are rounded to whole ones they have no facets in one plane.
  static int grey(int x, int y) {
    return static_cast<int>(std::lround(100 + 60 * std::sin(x / 37.) + 50 * std::cos(y / 29.) +
                                        15 * std::sin((x + 2 * y) / 10.)));
  }
  const double by_default = supersteps::RunOptions{}.coincidence;
  samples::TemporaryFolder folder_;
};

/// Heights with few digits are as whole numbers are: facets in one plane are so exactly.
TEST_F(Landscapes, OfFewDigitsCostAsMuchWithoutATolerance) {
  const auto tenths = [](int x, int y) {
    return std::to_string(grey(x, y) / 10) + "." + std::to_string(grey(x, y) % 10);
  };
  for (const bool is_picture : {false, true}) {
    const auto report = [&](double coincidence) {
      return is_picture ? report_of_file(cases() / "surface-slow.csg", coincidence)
                        : report_of(60, 45, coincidence, tenths);
    };
    const auto merged = report(by_default), exact = report(0);
    EXPECT_NEAR(exact.in_volume, merged.in_volume, 1e-12 * merged.in_volume);
    EXPECT_LT(work_of(exact), 1.1 * work_of(merged)) << is_picture;
  }
}

TEST_F(Landscapes, OfWholeGreysCostNoMoreThanNoise) {
  std::mt19937 random(1);
  for (const double coincidence : {by_default, 0.0}) {
    const auto hills = report_of(60, 45, coincidence, grey);
    const auto noise = report_of(60, 45, coincidence, [&](int, int) { return random() % 256; });
    EXPECT_LT(work_of(hills), work_of(noise)) << coincidence;
  }
}

/// Greys as doubles: planes differ in their last digits, and are cut along each other.
TEST_F(Landscapes, CostInProportionToTheirSize) {
  const auto rounded = [](int x, int y) {
    std::ostringstream text;
    text.precision(17);
    text << std::scientific << grey(x, y) * (100. / 255);
    return text.str();
  };
  for (const double coincidence : {by_default, 0.0}) {
    const auto small = report_of(45, 30, coincidence, rounded),
               large = report_of(90, 60, coincidence, rounded);
    EXPECT_LT(work_of(large), 4 * 1.3 * work_of(small)) << coincidence;
  }
}

}  // namespace
}  // namespace bsp2::models
