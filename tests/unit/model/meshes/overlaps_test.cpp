// Which meshes of a text overlap themselves, and what their faces sum up to.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bsp2/model/expression/csg.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::model {
namespace {

using Corner = std::array<double, 3>;

struct Box {
  Corner low, high;
  [[nodiscard]] double volume() const { return (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]); }
  [[nodiscard]] bool overlaps(const Box& other) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (low[k] >= other.high[k] || other.low[k] >= high[k]) return false;
    return true;
  }
};

std::string number(double x) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

std::string vector(const std::vector<double>& values) {
  std::string text;
  for (const double x : values) text += (text.empty() ? "[" : ",") + number(x);
  return text + "]";
}

/// The faces of a box, clockwise seen from outside, of corners whose bits are x, y and z.
constexpr std::array<std::array<int, 4>, 6> box_faces{
    {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};

/// One polyhedron of all these boxes. @param turned which of them are inside out.
std::string polyhedron_of(const std::vector<Box>& boxes, std::size_t turned = ~std::size_t{0}) {
  std::string points, faces;
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    for (std::size_t i = 0; i < 8; ++i) {
      std::vector<double> point;
      for (std::size_t k = 0; k < 3; ++k) point.push_back((i >> k & 1 ? boxes[b].high : boxes[b].low)[k]);
      points += vector(point) + ",";
    }
    for (const auto& face : box_faces) {
      std::vector<double> corners;
      for (const int corner : face) corners.push_back(static_cast<double>(8 * b) + corner);
      if (b == turned) std::reverse(corners.begin(), corners.end());
      faces += vector(corners) + ",";
    }
  }
  return "polyhedron(points = [" + points + "], faces = [" + faces + "]);";
}

std::string cube_at(double x, double side) {
  return polyhedron_of({{{x, x, x}, {x + side, x + side, x + side}}});
}
std::string two_cubes(double x) {
  return polyhedron_of({{{0, 0, 0}, {2, 2, 2}}, {{x, x, x}, {x + 2, x + 2, x + 2}}});
}

std::string mapped(const std::vector<double>& rows, const std::string& children) {
  std::string text;
  for (std::size_t i = 0; i < 3; ++i)
    text += vector({rows.begin() + static_cast<std::ptrdiff_t>(4 * i),
                    rows.begin() + static_cast<std::ptrdiff_t>(4 * i + 4)}) +
            ",";
  return "multmatrix([" + text + "[0,0,0,1]]) {" + children + "}";
}

MeshOverlaps overlaps(const std::string& text, const std::string& name = "test.csg") {
  return overlaps_of(parse_csg(text, name), text, name);
}

/// Large meshes, of which all threads look at each or each at one, and small ones: the same is told by any
/// number of threads.
TEST(Overlaps, AreTheSameForAnyThreads) {
  const auto boxes_in_a_row = [](std::size_t count, double step) {
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = static_cast<double>(i) * step;
      boxes.push_back({{x, 0, 0}, {x + 2, 2, 2}});
    }
    return boxes;
  };
  auto crossing = boxes_in_a_row(900, 3);  // 10,800 triangles
  crossing.push_back({{1501, 1, 1}, {1502, 5, 5}});
  auto nested = boxes_in_a_row(900, 3);
  nested.push_back({{1500.5, 0.5, 0.5}, {1501.5, 1.5, 1.5}});
  const std::string text = polyhedron_of(crossing) + polyhedron_of(boxes_in_a_row(900, 3)) + two_cubes(1) +
                           polyhedron_of(nested) + two_cubes(3);
  const Model model = parse_csg(text, "test.csg");
  const MeshOverlaps alone = overlaps_of(model, text, "test.csg", 1);
  ASSERT_EQ(alone.meshes.size(), 3U);
  EXPECT_EQ(alone.warnings.size(), 3U);
  for (const unsigned threads : {2U, 5U}) {  // fewer than there are large ones, and more
    const MeshOverlaps found = overlaps_of(model, text, "test.csg", threads);
    EXPECT_EQ(found.warnings, alone.warnings);
    ASSERT_EQ(found.meshes.size(), alone.meshes.size());
    for (std::size_t i = 0; i < found.meshes.size(); ++i) {
      EXPECT_EQ(found.meshes[i].place, alone.meshes[i].place);
      EXPECT_EQ(found.meshes[i].volume_by_faces, alone.meshes[i].volume_by_faces);
    }
  }
}

/// What is known to be sound is not looked at: nothing is told of it, whatever it is, and the same of all
/// others as without.
TEST(Overlaps, AreNotLookedForWhereNoneAreKnownToBe) {
  const std::string text = two_cubes(1) + two_cubes(3) + two_cubes(1.5);
  const Model model = parse_csg(text, "test.csg");
  const MeshOverlaps all = overlaps_of(model, text, "test.csg");
  ASSERT_EQ(all.meshes.size(), 2U);
  ASSERT_EQ(model.meshes.size(), 3U);
  const auto mesh = [&](std::size_t i) {
    return &std::get<TriangleMesh>(std::get<Primitive>(model.meshes[i].solid.node().value));
  };
  const std::vector<const TriangleMesh*> apart{mesh(1)}, first{mesh(0)}, every{mesh(0), mesh(1), mesh(2)};
  EXPECT_EQ(overlaps_of(model, text, "test.csg", 1, apart).warnings, all.warnings);
  const MeshOverlaps others = overlaps_of(model, text, "test.csg", 1, first);
  ASSERT_EQ(others.meshes.size(), 1U);
  EXPECT_EQ(others.meshes[0].place, all.meshes[1].place);
  EXPECT_TRUE(overlaps_of(model, text, "test.csg", 1, every).meshes.empty());
}

/// k boxes sum up to the sum of their volumes, times the determinants of the maps around them, however they
/// lie. All numbers are small integers, so this sum is exact; equal coordinates make faces lie in one plane,
/// touch, and be the same.
TEST(Overlaps, FacesSumUpToAllBoxesTimesTheDeterminants) {
  int overlapping = 0, apart = 0;
  const unsigned first_seed = samples::new_seed();
  for (unsigned seed = first_seed; seed != first_seed + 400; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](int low, int high) {
      return static_cast<double>(std::uniform_int_distribution(low, high)(random));
    };
    const double reach = draw(3, 12);
    std::vector<Box> boxes(static_cast<std::size_t>(draw(2, 5)));
    double sum = 0;
    for (Box& box : boxes) {
      for (std::size_t k = 0; k < 3; ++k) {
        box.low[k] = draw(0, static_cast<int>(reach) - 1);
        box.high[k] = draw(static_cast<int>(box.low[k]) + 1, static_cast<int>(reach));
      }
      sum += box.volume();
    }
    bool expected = false;
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) expected = expected || boxes[i].overlaps(boxes[j]);
    std::string text = polyhedron_of(boxes);
    for (int maps = static_cast<int>(draw(0, 3)); maps > 0; --maps) {
      std::vector<double> m(12);
      double determinant = 0;
      while (determinant == 0) {
        for (double& entry : m) entry = draw(-5, 5);
        determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                      m[2] * (m[4] * m[9] - m[5] * m[8]);
      }
      sum *= std::fabs(determinant);
      text = (maps == 1 ? "group() {" : "color([1, 0, 0]) {") + mapped(m, text) + "}";
    }
    const MeshOverlaps found = overlaps(text);
    (expected ? overlapping : apart)++;
    ASSERT_EQ(found.meshes.size(), expected) << "seed " << seed << ": " << text;
    EXPECT_EQ(found.warnings.size(), found.meshes.size());
    if (!expected) continue;
    ASSERT_TRUE(found.meshes[0].volume_by_faces);
    EXPECT_NEAR(*found.meshes[0].volume_by_faces, sum, 1e-14 * sum) << "seed " << seed << ": " << text;
  }
  EXPECT_GT(overlapping, 100);
  EXPECT_GT(apart, 20);
}

/// Where plain doubles lose digits: far from the origin, under a shear of determinant 1 of large entries, of
/// cubes that all but cancel.
TEST(Overlaps, TheSumKeepsItsDigits) {
  const auto volume = [](const std::string& text) {
    return overlaps(text).meshes.at(0).volume_by_faces.value();
  };
  const double far = 0x1p30;
  EXPECT_DOUBLE_EQ(volume(polyhedron_of({{{far, far, far}, {far + 2, far + 2, far + 2}},
                                         {{far + 1, far + 1, far + 1}, {far + 3, far + 3, far + 3}}})),
                   16);
  EXPECT_DOUBLE_EQ(volume(mapped({1e6, 1e6 + 1, 0, 7, 1e6 - 1, 1e6, 0, -1e9, 0, 0, 3, 0}, two_cubes(1))), 48);
  EXPECT_DOUBLE_EQ(volume(mapped({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, two_cubes(1))), 16) << "a mirror";
  // 2^60 + 2^20 wound one way round, 2^60 the other.
  const double large = 0x1p20, height = large + 0x1p-20;
  EXPECT_DOUBLE_EQ(
      volume(polyhedron_of(
          {{{0, 0, 0}, {large, large, height}}, {{1, 1, 1}, {large + 1, large + 1, large + 1}}}, 1)),
      large);
}

TEST(Overlaps, AreWhereFacesWindOtherThanOnce) {
  const auto shells = [](double side, std::size_t turned) {
    return overlaps(
        polyhedron_of({{{0, 0, 0}, {8, 8, 8}}, {{1, 1, 1}, {1 + side, 1 + side, 1 + side}}}, turned));
  };
  EXPECT_TRUE(shells(3, 1).meshes.empty()) << "a cavity";
  const MeshOverlaps nested = shells(3, 2);
  ASSERT_EQ(nested.meshes.size(), 1U);
  EXPECT_EQ(nested.meshes[0].volume_by_faces, 512 + 27);
  EXPECT_EQ(nested.meshes[0].triangles, 24U);
  ASSERT_EQ(nested.warnings.size(), 1U);
  EXPECT_NE(nested.warnings[0].find("its faces wind 2 times around a point"), std::string::npos)
      << nested.warnings[0];
  EXPECT_NE(nested.warnings[0].find("sum up to, 539,"), std::string::npos) << nested.warnings[0];
  EXPECT_EQ(shells(9, 1).meshes.size(), 1U) << "out of the other";
  const MeshOverlaps beside = overlaps(polyhedron_of({{{0, 0, 0}, {2, 2, 2}}, {{5, 5, 5}, {6, 6, 6}}}, 1));
  ASSERT_EQ(beside.meshes.size(), 1U) << "inside out, beside the other: -1 times";
  EXPECT_EQ(beside.meshes[0].volume_by_faces, 8 - 1);
  EXPECT_TRUE(overlaps(polyhedron_of({{{0, 0, 0}, {2, 2, 2}}}, 0)).meshes.empty())
      << "inside out as a whole: it is turned";
  EXPECT_TRUE(overlaps(two_cubes(2) + two_cubes(3) + cube_at(0, 1) + "cube(3); circle(2);").meshes.empty())
      << "touching, apart, and no such meshes";
}

/// Each place of a mesh by itself, with what the maps there make of it.
TEST(Overlaps, EachPlaceIsListed) {
  const std::string text = "cube(1);\n" + two_cubes(1) + "\n group() { difference() { " +
                           mapped({2, 0, 0, 9, 0, 2, 0, 0, 0, 0, 2, 0}, two_cubes(1)) + " cube(1); } }\n" +
                           two_cubes(1.5);
  const MeshOverlaps found = overlaps(text);
  ASSERT_EQ(found.meshes.size(), 3U);
  EXPECT_EQ(found.warnings.size(), 2U) << "equal ones once";
  const std::array<std::pair<const char*, double>, 3> expected{
      {{"test.csg:2:1", 16}, {"test.csg:3:", 128}, {"test.csg:4:1", 16}}};
  const std::array<std::size_t, 3> parts{1, 2, 4};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(found.meshes[i].place.starts_with(expected[i].first)) << found.meshes[i].place;
    EXPECT_EQ(found.meshes[i].volume_by_faces, expected[i].second);
    EXPECT_EQ(found.meshes[i].part, parts[i]);
    EXPECT_EQ(found.meshes[i].file, "");
  }
}

TEST(Overlaps, WhatTakesNoPartIsNotListed) {
  const std::string two = two_cubes(1);
  for (const std::string& text :
       {"cube(1); %" + two, "cube(1); *" + two, two + " !cube(1);",
        "cube(1); intersection() { cube(0); " + two + " }", "cube(1); square(1); hull() { " + two + " }",
        "hull() { group() { " + two + " } }", "hull() { minkowski() { " + two + " cube(1); } }"})
    EXPECT_TRUE(overlaps(text).meshes.empty()) << text;
  const std::string halved = mapped({.5, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, "!" + two + " cube(1);");
  ASSERT_EQ(overlaps(halved).meshes.size(), 1U);
  EXPECT_EQ(overlaps(halved).meshes[0].volume_by_faces, 16) << "the root leaves out the maps around it";
}

/// Under a construct there is no volume that the mesh has in the model.
TEST(Overlaps, ConstructsLeaveNoVolume) {
  for (const std::string around :
       {"resize([4, 0, 0])", "projection(cut = true)", "linear_extrude(height = 1) projection()",
        "minkowski() { difference()", "minkowski() { group()", "minkowski() { minkowski()"}) {
    const std::string text =
        around + " { " + two_cubes(1) + " }" + (around.starts_with("mink") ? " cube(1); }" : "");
    const MeshOverlaps found = overlaps(text);
    ASSERT_EQ(found.meshes.size(), 1U) << text;
    EXPECT_FALSE(found.meshes[0].volume_by_faces) << text;
    ASSERT_EQ(found.warnings.size(), 1U);
    EXPECT_EQ(found.warnings[0].find("sum up to"), std::string::npos) << found.warnings[0];
  }
}

/// A sum takes a closed mesh as the solid that it is, so overlaps matter there.
TEST(Overlaps, ASumIsToldOf) {
  const MeshOverlaps found = overlaps("minkowski() { " + two_cubes(1) + " cube(1); }");
  ASSERT_EQ(found.meshes.size(), 1U);
  EXPECT_FALSE(found.meshes[0].volume_by_faces);
  EXPECT_EQ(found.warnings.size(), 1U);
}

/// A file that is imported twice is one mesh in two places.
TEST(Overlaps, ImportsNameTheirFiles) {
  const samples::TemporaryFolder folder;
  const std::string name = (folder.path() / "test.csg").string();
  const auto write = [&](const char* file, double x, double side) {
    std::ofstream out(folder.path() / file);
    out << "OFF\n16 12 0\n";
    for (int i = 0; i < 16; ++i)
      for (int k = 0; k < 3; ++k)
        out << (i < 8 ? 0 : x) + (i >> k & 1) * (i < 8 ? 2 : side) << (k == 2 ? "\n" : " ");
    for (int b = 0; b < 16; b += 8)
      for (const auto& [p, q, r, s] : box_faces)
        out << "4 " << b + s << " " << b + r << " " << b + q << " " << b + p << "\n";
  };
  write("crossing.off", 1, 2);
  write("nested.off", .5, 1);
  write("apart.off", 3, 2);
  const MeshOverlaps found =
      overlaps("import(file = \"crossing.off\");" +
                   mapped({3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, "import(file = \"crossing.off\");") +
                   "import(file = \"nested.off\"); import(file = \"apart.off\");",
               name);
  ASSERT_EQ(found.meshes.size(), 3U);
  const std::array<std::pair<const char*, double>, 3> expected{
      {{"crossing.off", 16}, {"crossing.off", 48}, {"nested.off", 9}}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(found.meshes[i].file, (folder.path() / expected[i].first).string());
    EXPECT_EQ(found.meshes[i].volume_by_faces, expected[i].second);
  }
  ASSERT_EQ(found.warnings.size(), 1U) << "that shells are nested is told when they are read";
  EXPECT_NE(found.warnings[0].find("crossing.off crosses itself: "), std::string::npos) << found.warnings[0];
}

}  // namespace
}  // namespace bsp2::model
