// Meshes of gmsh: text and binary, both versions, surfaces and solid elements.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"

namespace bsp2::model {
namespace {

constexpr std::string_view nodes_2 = "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n40 0 0 1\n5 0 0 -2\n$EndNodes\n";

std::string message_of(const std::string& bytes) {
  try {
    import_msh(bytes, "x.msh");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

double enclosed_by(const ImportedPart& part) {
  const auto mesh = closed_mesh(part.mesh.points, part.mesh.faces);
  return mesh ? signed_volume(mesh->points, mesh->triangles) : 0;
}

std::string version_2(const std::string& elements) {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 \"upper part\"\n2 7 "
         "\"floor\"\n$EndPhysicalNames\n" +
         std::string(nodes_2) + "$Comment\nanything\n$EndComment\n$Elements\n" + elements + "$EndElements\n";
}

TEST(Msh, SurfacesAreOneMeshWhereGroupsAreSides) {
  const auto parts = import_msh(
      version_2("5\n1 15 2 0 1 1\n2 2 2 7 1 1 3 2\n3 2 2 8 2 1 2 40\n4 2 2 8 2 1 40 3\n5 2 2 8 2 2 3 40\n"),
      "x.msh");
  ASSERT_EQ(parts.parts.size(), 1U);
  EXPECT_EQ(parts.parts[0].name, "");
  EXPECT_EQ(parts.notes.size(), 1U);
  EXPECT_NEAR(enclosed_by(parts.parts[0]), 1 / 6.0, 1e-15);
}

/// Of solid elements the outside of each group is a part; elements that are inside out are turned.
TEST(Msh, SolidElementsHaveAnOutside) {
  const auto parts = import_msh(version_2("2\n1 4 2 1 1 1 2 3 40\n2 4 2 9 2 1 2 3 5\n"), "x.msh");
  ASSERT_EQ(parts.parts.size(), 2U);
  EXPECT_EQ(parts.parts[0].name, "upper part");
  EXPECT_NEAR(enclosed_by(parts.parts[0]), 1 / 6.0, 1e-15);
  EXPECT_NEAR(enclosed_by(parts.parts[1]), 2 / 6.0, 1e-15);
  EXPECT_EQ(
      import_msh(version_2("2\n1 4 2 1 1 1 2 3 40\n2 4 2 1 2 1 2 3 5\n"), "x.msh").parts[0].mesh.faces.size(),
      6U);
}

template <typename T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

/// The same solid in the four forms.
TEST(Msh, VersionsAndFormsAreTheSame) {
  const std::string text_4 =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n$EndPhysicalNames\n"
      "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 1 0\n$EndEntities\n"
      "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
      "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n";
  std::string binary_4 = "$MeshFormat\n4.1 1 8\n";
  put(binary_4, 1);
  binary_4 += "\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n$EndPhysicalNames\n$Entities\n";
  for (const std::uint64_t count : {0, 0, 0, 1}) put(binary_4, count);
  put(binary_4, 1);
  for (int i = 0; i < 6; ++i) put(binary_4, 0.5);
  put(binary_4, std::uint64_t{1});
  put(binary_4, 1);
  put(binary_4, std::uint64_t{0});
  binary_4 += "\n$EndEntities\n$Nodes\n";
  for (const std::uint64_t number : {1, 4, 1, 4}) put(binary_4, number);
  for (const int number : {3, 1, 0}) put(binary_4, number);
  for (const std::uint64_t number : {4, 1, 2, 3, 4}) put(binary_4, number);
  for (const double x : {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) put(binary_4, x);
  binary_4 += "\n$EndNodes\n$Elements\n";
  for (const std::uint64_t number : {1, 1, 1, 1}) put(binary_4, number);
  for (const int number : {3, 1, 4}) put(binary_4, number);
  for (const std::uint64_t number : {1, 1, 1, 2, 3, 4}) put(binary_4, number);
  binary_4 += "\n$EndElements\n";
  std::string binary_2 = "$MeshFormat\n2.2 1 8\n";
  put(binary_2, 1);
  binary_2 += "\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n$EndPhysicalNames\n$Nodes\n4\n";
  const Point3 points[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 4; ++i) {
    put(binary_2, i + 1);
    for (const double x : points[i]) put(binary_2, x);
  }
  binary_2 += "\n$EndNodes\n$Elements\n1\n";
  for (const int number : {4, 1, 2, 1, 1, 1, 1, 2, 3, 4}) put(binary_2, number);
  binary_2 += "\n$EndElements\n";
  for (const std::string& bytes : {text_4, binary_4, binary_2}) {
    const auto parts = import_msh(bytes, "x.msh");
    ASSERT_EQ(parts.parts.size(), 1U);
    EXPECT_EQ(parts.parts[0].name, "all");
    EXPECT_NEAR(enclosed_by(parts.parts[0]), 1 / 6.0, 1e-15);
    for (std::size_t length = 0; length + 12 < bytes.size(); ++length)
      ASSERT_NE(message_of(bytes.substr(0, length)), "no error") << length;
  }
}

TEST(Msh, TellsWhatIsWrongAndWhere) {
  EXPECT_EQ(message_of("solid"), "x.msh:1: is no mesh of gmsh: it does not begin with $MeshFormat");
  EXPECT_NE(message_of("$MeshFormat\n4.0 0 8\n").find("x.msh:2: the version 4.0 is not read"),
            std::string::npos);
  EXPECT_NE(message_of(version_2("1\n1 2 2 0 1 1 2 99\n")).find("an element names node 99"),
            std::string::npos);
  EXPECT_NE(message_of(version_2("99999999999\n")).find("tells of 99,999,999,999 elements"), std::string::npos);
  EXPECT_NE(message_of(version_2("1\n1 77 2 0 1 1\n")).find("elements of type 77"), std::string::npos);
  EXPECT_NE(message_of(version_2("1\n1 1 2 0 1 1 2\n")).find("no triangles"), std::string::npos);
}

}  // namespace
}  // namespace bsp2::model
