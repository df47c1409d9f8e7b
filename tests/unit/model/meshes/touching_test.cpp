// Parts that close only together, and names that are there once.
#include <gtest/gtest.h>

#include "import/imports.hpp"
#include "import/part_names.hpp"
#include "mesh/mesh_touching.hpp"

namespace bsp2::model {
namespace {

/// A box without some of its six sides: bit i leaves out side i, which are -x, +x, -y, ....
ImportedMesh box(const Point3& lower, unsigned left_out) {
  ImportedMesh mesh;
  for (unsigned i = 0; i < 8; ++i)
    mesh.add_point({lower[0] + (i & 1U), lower[1] + (i >> 1 & 1U), lower[2] + (i >> 2 & 1U)});
  const std::uint32_t sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (unsigned i = 0; i < 6; ++i)
    if ((left_out >> i & 1U) == 0) mesh.add_face(sides[i]);
  return mesh;
}

std::vector<std::vector<std::size_t>> groups(const std::vector<ImportedMesh>& meshes) {
  std::vector<MeshView> views;
  for (const ImportedMesh& mesh : meshes) views.push_back({mesh.points, mesh.faces});
  return closed_together(views);
}

TEST(Touching, WhatClosesTogetherIsOne) {
  using Groups = std::vector<std::vector<std::size_t>>;
  const ImportedMesh whole = box({9, 0, 0}, 0), left = box({0, 0, 0}, 1U << 1),
                     right = box({1, 0, 0}, 1U << 0);
  EXPECT_EQ(groups({left, whole, right}), (Groups{{0, 2}, {1}}));
  EXPECT_EQ(groups({left, whole}), (Groups{{0}, {1}})) << "a hole stays one";
  EXPECT_EQ(groups({left, right, box({2, 0, 0}, 0)}), (Groups{{0, 1}, {2}})) << "closed by itself";
  EXPECT_EQ(groups({left, box({1, 0, 0}, 3)}), (Groups{{0}, {1}})) << "open even together";
}

TEST(PartNames, AreThereOnceAndPrintable) {
  PartNames names;
  EXPECT_EQ(names.once("a"), "a");
  EXPECT_EQ(names.once("a (2)"), "a (2)");
  EXPECT_EQ(names.once("a"), "a (3)");
  EXPECT_EQ(names.once(""), "");
  EXPECT_EQ(names.once(""), "");
  EXPECT_EQ(printable_name(" a\nb\x80\xC3\xA4 "), "a b?\xC3\xA4");
  EXPECT_EQ(printable_name("\xED\xA0\x80"), "???") << "half a character of UTF-16";
  EXPECT_EQ(printable_name(std::string(500, 'x')).size(), 200U);
}

}  // namespace
}  // namespace bsp2::model
