// What `--group NAME=WHERE` means, and what is said where it means nothing.
#include "bsp2/api/products/group_rule.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::api {
namespace {

using Condition = meshing::GroupRule::Condition;

std::string message_of(const std::string& text) {
  try {
    (void)parse_group(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// A sum is written with its terms in any order and spacing, and read.
TEST(GroupRule, HalfSpacesAreReadAsTheyAreWritten) {
  const std::uint64_t seed = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937_64 random(seed);
  const auto pick = [&](int least, int most) { return std::uniform_int_distribution(least, most)(random); };
  const auto gap = [&] { return std::string(static_cast<std::size_t>(pick(0, 2)), ' '); };
  for (int round = 0; round < samples::rounds(200); ++round) {
    std::string text = "a b=";
    std::vector<Condition> expected;
    for (int i = pick(1, 3); i > 0; --i) {
      Condition condition;
      bool is_first = true;
      const int terms = pick(1, 4);
      for (int term = 0; term < terms || condition.normal == meshing::Point{}; ++term) {
        const int axis = pick(0, 2);
        const double factor = pick(1, 9) / 4.0, sign = pick(0, 1) == 0 ? 1 : -1;
        condition.normal[static_cast<std::size_t>(axis)] += sign * factor;
        text += gap() + (sign < 0 ? "-" : is_first ? "" : "+") + gap();
        if (factor != 1 || pick(0, 1) == 0)
          text += std::to_string(factor) + gap() + (pick(0, 1) == 0 ? "*" : "") + gap();
        text += std::string(1, static_cast<char>('x' + axis)) + gap();
        is_first = false;
      }
      const std::array<const char*, 3> signs{"==", "<=", ">="};
      const auto sign = static_cast<std::size_t>(pick(0, 2)), bound = static_cast<std::size_t>(pick(0, 2));
      condition.sign = static_cast<Condition::Sign>(sign);
      condition.bound = static_cast<Condition::Bound>(bound);
      if (bound == 0) condition.value = pick(-9, 9) / 2.0;
      const std::array bounds{std::to_string(condition.value), std::string("min"), std::string("max")};
      text += signs[sign] + gap() + bounds[bound] + gap() + (i > 1 ? "&" : "");
      expected.push_back(condition);
    }
    const meshing::GroupRule rule = parse_group(text);
    EXPECT_EQ(rule.name, "a b");
    ASSERT_EQ(rule.conditions.size(), expected.size()) << text;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(rule.conditions[i].normal, expected[i].normal) << text;
      ASSERT_EQ(rule.conditions[i].value, expected[i].value) << text;
      ASSERT_EQ(rule.conditions[i].sign, expected[i].sign) << text;
      ASSERT_EQ(rule.conditions[i].bound, expected[i].bound) << text;
    }
  }
}

TEST(GroupRule, ColoursAndAnglesAreRead) {
  const auto rule = parse_group("skin = colour==Red & color == #00f8&angle <= 30 & x<=1");
  ASSERT_EQ(rule.colours.size(), 2U);
  EXPECT_EQ(rule.colours[0], (meshing::Rgba{255, 0, 0, 255}));
  EXPECT_EQ(rule.colours[1], (meshing::Rgba{0, 0, 255, 136}));
  EXPECT_EQ(rule.angle, 30);
  EXPECT_EQ(rule.conditions.size(), 1U);
}

TEST(GroupRule, MistakesAreToldWithTheirPlace) {
  const std::array<std::array<const char*, 2>, 15> wrong{{
      {"q", "must be NAME=WHERE"},
      {"=x==min", "must be NAME=WHERE"},
      {"x==min", "character 3: expected x, y, z, colour or angle, found '=min'"},
      {"a=", "character 3: expected x, y, z, colour or angle, found the end"},
      {"a=x=1", "character 4: expected ==, <= or >=, found '=1'"},
      {"a=x<1", "character 4: expected ==, <= or >=, found '<1'"},
      {"a=x==1e", "character 7: expected & or the end, found 'e'"},
      {"a=x==min&", "character 10: expected x, y, z, colour or angle, found the end"},
      {"a=2*x - 2*x <= 1", "character 3: the factors of x, y and z are all 0"},
      {"a=x<=high", "character 6: expected a number, found 'high'"},
      {"a=q==1", "character 3: 'q' is none of x, y, z, colour and angle"},
      {"a=x==1 & colur==red",
       "character 10: 'colur' is none of x, y, z, colour and angle; did you mean 'colour'?"},
      {"a=colour==oragne",
       "character 11: 'oragne' is no colour: write a name of CSS or #rrggbb; did you mean 'orange'?"},
      {"a=colour<=red", "character 9: expected ==, found '<=red'"},
      {"a=angle<=181", "character 10: expected an angle of 0 to 180 degrees, found '181'"},
  }};
  for (const auto& [text, words] : wrong)
    EXPECT_NE(message_of(text).find(words), std::string::npos) << message_of(text);
}

}  // namespace
}  // namespace bsp2::api
