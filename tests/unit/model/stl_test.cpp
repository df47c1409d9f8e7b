// Binary STL files whose header tells a wrong number of facets: the length of the file tells.

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::model {
namespace {

void put(std::string& bytes, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(word >> (8 * i) & 0xFF);
}

/// Tetrahedra in a row, as a binary file. @param told the number of facets in its header.
std::string tetrahedra(std::uint32_t count, std::uint32_t told, const std::string& header = "binary") {
  std::string bytes = header;
  bytes.resize(80, ' ');
  put(bytes, told);
  for (std::uint32_t t = 0; t < count; ++t)
    for (const auto& facet : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
      bytes.append(12, '\0');
      for (const int corner : facet)
        for (int k = 0; k < 3; ++k)
          put(bytes, std::bit_cast<std::uint32_t>((corner == k + 1 ? 1.0F : 0.0F) +
                                                  (k == 0 ? 2.0F * static_cast<float>(t) : 0)));
      bytes.append(2, '\0');
    }
  return bytes;
}

ImportedMesh read(const std::string& bytes) { return import_stl(bytes, "x.stl"); }

std::string fault(const std::string& bytes) {
  try {
    read(bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(StlCount, IsAsTheLengthSays) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const auto count = static_cast<std::uint32_t>(1 + random() % 20), facets = 4 * count;
    const auto other = static_cast<std::uint32_t>(round % 2 == 0 ? random() % facets
                                                                 : facets + 1 + random() % 1'000'000'000);
    const std::uint32_t told = round % 4 == 0 ? facets : round % 4 == 1 ? 0 : other;
    const ImportedMesh mesh =
        read(tetrahedra(count, told, round % 3 == 0 ? "binary" : "solid facet of some program"));
    EXPECT_EQ(mesh.faces.size(), facets) << told;
    EXPECT_EQ(mesh.warnings.size(), told == facets ? 0U : 1U) << told;
  }
}

TEST(StlCount, IsTold) {
  EXPECT_EQ(read(tetrahedra(1, 0)).warnings[0],
            "the header says 0 facets, but by its length the file holds 4; all of them are read. Write the "
            "file again with the right number to be sure");
  EXPECT_EQ(read(tetrahedra(1, 1)).warnings[0],
            "the header says 1 facet, but by its length the file holds 4; all of them are read. Write the "
            "file again with the right number to be sure");
  EXPECT_EQ(read(tetrahedra(1, 0xFFFFFFFF)).warnings[0],
            "the header says 4,294,967,295 facets, but the file ends after 4; these are read. If the file is "
            "cut off, the rest is missing: get it again");
}

TEST(StlCount, IsRightWhereTheRestIsNoFacet) {
  const std::string sound = tetrahedra(1, 4);
  EXPECT_TRUE(read(sound + "\n").warnings.empty()) << "a few bytes more are nothing";
  const ImportedMesh more = read(sound + std::string(70, '\x7F'));
  EXPECT_EQ(more.faces.size(), 4U);
  ASSERT_EQ(more.warnings.size(), 1U);
  EXPECT_EQ(more.warnings[0], "70 bytes are passed over after the 4 facets that the header tells of");
  EXPECT_EQ(read(sound + std::string(100, '\x7F')).faces.size(), 4U) << "these are no numbers";
  EXPECT_EQ(read(tetrahedra(0, 0)).faces.size(), 0U);
  EXPECT_EQ(read(tetrahedra(1, 0) + "xyz").faces.size(), 4U) << "nobody writes nothing and then something";
}

/// In the midst of a facet it is cut off for certain.
TEST(StlCount, WhatIsCutOffIsAnError) {
  const std::string sound = tetrahedra(3, 12);
  for (std::size_t size = 84; size < sound.size(); ++size) {
    const std::string text = fault(sound.substr(0, size));
    if ((size - 84) % 50 != 0 || size == 84)
      EXPECT_NE(text.find("it is cut off, or no STL file"), std::string::npos) << size;
    else
      EXPECT_EQ(read(sound.substr(0, size)).warnings.size(), 1U) << size;
  }
}

TEST(StlCount, TextsStayTexts) {
  const std::string text =
      "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
      "0\nendloop\nendfacet\nendsolid x\n";
  EXPECT_EQ(read(text).faces.size(), 1U);
  EXPECT_TRUE(read(text).warnings.empty());
  EXPECT_EQ(read("SOLID " + std::string(300, 'x') + text.substr(7)).faces.size(), 1U);
  EXPECT_EQ(read("solid\nendsolid\n").faces.size(), 0U);
}

TEST(StlCount, TheCaseIsASolid) {
  std::vector<std::string> warnings;
  const auto solids = solids_of_file(BSP2_SOURCE_DIR "/tests/cases/stl-count-0.stl", {},
                                     {[&](const std::string& text) { warnings.push_back(text); }, {}});
  ASSERT_EQ(solids.size(), 1U);
  EXPECT_EQ(solids[0].mesh.triangles.size(), 12U);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(
      warnings[0].find("stl-count-0.stl: the header says 0 facets, but by its length the file holds 12;"),
      std::string::npos)
      << warnings[0];
}

}  // namespace
}  // namespace bsp2::model
