// Inputs of tests/cases that went wrong under constructs, each with the right value of cases.tsv.

#include <gtest/gtest.h>

#include <string>

#include "models.hpp"

namespace bsp2::models {
namespace {

TEST(ConstructCases, HaveTheRightContent) {
  const struct {
    const char* file;
    double coincidence, content;
  } right[] = {{"coincidence-0-fill.csg", 0, 237.764129074},
               {"coincidence-0-twist.csg", 0, 255.936969912},
               {"coincidence-0-slow-twist.csg", 0, 2924.05894629},
               {"lathe-clean.csg", 1e-9, 21860.7803111},
               {"lathe-clean.csg", 0, 21860.7803111},
               {"extrude-scale-one-zero.csg", 1e-9, 1437.5},
               {"extrude-scale-one-zero.csg", 0, 1437.5},
               {"hull-of-flat.csg", 1e-9, 4},
               {"hull-of-flat.csg", 0, 4}};
  for (const auto& [file, coincidence, content] : right) {
    const auto report = run_file(cases() / file, 2, coincidence);
    EXPECT_NEAR(report.in_volume, content, 1e-9 * content) << file;
    EXPECT_TRUE(report.warnings.empty()) << file << ": " << report.warnings.front();
  }
}

}  // namespace
}  // namespace bsp2::models
