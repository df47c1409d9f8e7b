// A drawing that ranks share against that of one process.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <sstream>

#include "bsp2/api/products/drawings.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "support/rounds.hpp"

namespace bsp2::api {
namespace {

using supersteps::Ranks;

/// Boxes, cylinders and balls side by side, through each other and behind each other.
std::string random_model(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-20, 20), size(2, 12);
  std::ostringstream text;
  for (int i = 0; i < 8; ++i) {
    text << "multmatrix([[0.8, -0.6, 0, " << place(random) << "], [0.6, 0.8, 0, " << place(random)
         << "], [0, 0, 1, " << place(random) << "], [0, 0, 0, 1]]) { ";
    if (i % 3 == 0) text << "cube(size = [" << size(random) << ", " << size(random) << ", 15]); }\n";
    if (i % 3 == 1) text << "cylinder($fn = 12, h = " << size(random) << ", r1 = 4, r2 = 3); }\n";
    if (i % 3 == 2) text << "sphere($fn = 10, r = " << size(random) << "); }\n";
  }
  return text.str();
}

supersteps::RunOptions options_of(const std::string& model) {
  supersteps::RunOptions options;
  options.model = "random.csg";
  options.text = std::make_shared<const std::string>(model);
  options.threads = 1;
  options.boundary = options.faces = true;
  return options;
}

drawing::Drawing drawn(const std::string& model, const DrawingOptions& words, Ranks& ranks) {
  const supersteps::RunOptions options = options_of(model);
  return draw(options, drawing_options(words), supersteps::run(options, ranks), ranks,
              [](const auto& again, auto& same) { return supersteps::run(again, same); });
}

TEST(Drawing, IsTheSameWhoeverFindsItsLines) {
  const char* given = std::getenv("BSP2_SEED");
  const auto seed =
      given != nullptr ? static_cast<std::uint32_t>(std::stoul(given)) : 7;  // one for all ranks
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(2); ++round) {
    const std::string model = random_model(random);
    DrawingOptions all, cut, one;  // which has fewer views than there are ranks
    all.views = {"front", "top", "left", "right", "iso"};
    cut = all;
    cut.sections = {"A=x:0", "B=z:1"};
    one.views = {"iso"};
    for (DrawingOptions words : {all, cut, one}) {
      words.date = "2000-01-01";
      words.sheet = "A2";
      Ranks alone;
      const drawing::Drawing expected = drawn(model, words, alone);
      Ranks ranks = Ranks::launched();
      drawing::Drawing shared;
      ranks.together([&] { shared = drawn(model, words, ranks); });
      if (!ranks.is_master()) continue;
      EXPECT_EQ(shared.notes, expected.notes);
      for (const auto format : {io::SheetFormat::svg, io::SheetFormat::dxf})
        EXPECT_TRUE(io::sheet_bytes(shared.sheet, format) == io::sheet_bytes(expected.sheet, format));
    }
  }
}

TEST(Drawing, WhatCannotBeDrawnEndsOnAllRanks) {
  struct Case {
    const char *model, *scale, *mistake;
  };
  for (const auto& [model, scale, mistake] :
       {Case{"cube(size = 10);", "1000:1", "do not fit"},
        Case{"difference() { cube(); cube(); }", "", "the solid is empty"}}) {
    DrawingOptions words;
    words.scale = scale;
    Ranks ranks = Ranks::launched();
    std::string text;
    try {
      ranks.together([&] { drawn(model, words, ranks); });
    } catch (const std::exception& error) {
      text = error.what();
    }
    EXPECT_NE(text.find(mistake), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace bsp2::api
