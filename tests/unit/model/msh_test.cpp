// Meshes of gmsh: text and binary, both versions, surfaces and solid elements.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iomanip>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/msh/size_field.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

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

/// One solid in the four forms.
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

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t bound) {
  return std::uniform_int_distribution<std::size_t>(0, bound - 1)(random);
}

/// A solid of cells of a grid that is bent so little that no tetrahedron turns over (1 - 0.3 > 2 * 0.3),
/// grown side by side: mostly not convex, also with holes and cavities. Each cell is six tetrahedra around
/// its diagonal, which fit those of its neighbours.
class RandomSolid {
 public:
  explicit RandomSolid(Random& random) {
    std::uniform_real_distribution<double> bend(-0.15, 0.15);
    for (std::size_t i = 0; i < 4 * 4 * 4; ++i) {
      const std::size_t x = i % 4, y = i / 4 % 4, z = i / 16;
      points_.push_back({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
      for (double& x : points_.back()) x += bend(random);
    }
    const std::size_t wanted = 1 + below(random, 24);
    for (cells_.insert(below(random, 27)); cells_.size() < wanted;) grow(random);
    for (const std::size_t cell : cells_) add(cell);
    for (const auto& t : tetrahedra_) volume_ += content(t);
  }

  [[nodiscard]] double volume() const { return volume_; }

  /// @param is_surface whether it has the triangles that belong to one tetrahedron, or the tetrahedra.
  [[nodiscard]] std::string text(Random& random, bool is_surface) const {
    std::vector<std::vector<std::size_t>> elements = is_surface ? skin() : tetrahedra_;
    std::shuffle(elements.begin(), elements.end(), random);
    if (!is_surface)
      for (auto& t : elements)
        if (below(random, 2) == 0) std::swap(t[0], t[1]);  // inside out
    return below(random, 2) == 0 ? version_2(elements) : version_4(elements);
  }

 private:
  std::vector<Point3> points_;
  std::set<std::size_t> cells_;
  std::vector<std::vector<std::size_t>> tetrahedra_;
  double volume_ = 0;

  void grow(Random& random) {
    static constexpr std::array<std::size_t, 3> step{1, 3, 9};
    auto from = cells_.begin();
    std::advance(from, below(random, cells_.size()));
    const std::size_t axis = below(random, 3), place = *from / step[axis] % 3;
    if (below(random, 2) == 0 && place > 0)
      cells_.insert(*from - step[axis]);
    else if (place < 2)
      cells_.insert(*from + step[axis]);
  }

  void add(std::size_t cell) {
    static constexpr std::array<std::size_t, 3> step{1, 4, 16};
    const std::size_t origin = cell % 3 + 4 * (cell / 3 % 3) + 16 * (cell / 9);
    std::array<std::size_t, 3> order{0, 1, 2};
    do {
      const std::size_t b = origin + step[order[0]], c = b + step[order[1]];
      std::vector<std::size_t> t{origin, b, c, c + step[order[2]]};
      if (content(t) < 0) std::swap(t[0], t[1]);
      tetrahedra_.push_back(t);
    } while (std::next_permutation(order.begin(), order.end()));
  }

  [[nodiscard]] double content(const std::vector<std::size_t>& t) const {
    std::array<Point3, 3> e{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) e[i][k] = points_[t[i + 1]][k] - points_[t[0]][k];
    const auto& [u, v, w] = e;
    return (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
            u[2] * (v[0] * w[1] - v[1] * w[0])) /
           6;
  }

  [[nodiscard]] std::vector<std::vector<std::size_t>> skin() const {
    std::map<std::set<std::size_t>, std::vector<std::vector<std::size_t>>> sides;
    for (const auto& t : tetrahedra_)
      for (const auto& side : {std::vector{t[0], t[2], t[1]}, std::vector{t[0], t[1], t[3]},
                               std::vector{t[0], t[3], t[2]}, std::vector{t[1], t[2], t[3]}})
        sides[{side.begin(), side.end()}].push_back(side);
    std::vector<std::vector<std::size_t>> outer;
    for (const auto& [key, of_key] : sides)
      if (of_key.size() == 1) outer.push_back(of_key[0]);
    return outer;
  }

  /// Nodes have the numbers 3 i + 7.
  void put_corners(std::ostream& text, const std::vector<std::size_t>& element) const {
    for (const std::size_t corner : element) text << ' ' << 3 * corner + 7;
    text << '\n';
  }

  void put_point(std::ostream& text, std::size_t i) const {
    text << points_[i][0] << ' ' << points_[i][1] << ' ' << points_[i][2] << '\n';
  }

  [[nodiscard]] std::string version_2(const std::vector<std::vector<std::size_t>>& elements) const {
    std::ostringstream text;
    text << std::setprecision(17) << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
         << points_.size() << '\n';
    for (std::size_t i = 0; i < points_.size(); ++i) put_point(text << 3 * i + 7 << ' ', i);
    text << "$EndNodes\n$Elements\n" << elements.size() << '\n';
    for (std::size_t i = 0; i < elements.size(); ++i)
      put_corners(text << i + 1 << ' ' << (elements[i].size() == 3 ? 2 : 4) << " 2 0 1", elements[i]);
    text << "$EndElements\n";
    return text.str();
  }

  [[nodiscard]] std::string version_4(const std::vector<std::vector<std::size_t>>& elements) const {
    const std::size_t dimension = elements[0].size() - 1, nodes = points_.size();
    std::ostringstream text;
    text << std::setprecision(17) << "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 " << nodes << " 7 "
         << 3 * nodes + 4 << '\n'
         << dimension << " 1 0 " << nodes << '\n';
    for (std::size_t i = 0; i < nodes; ++i) text << 3 * i + 7 << '\n';
    for (std::size_t i = 0; i < nodes; ++i) put_point(text, i);
    text << "$EndNodes\n$Elements\n1 " << elements.size() << " 1 " << elements.size() << '\n'
         << dimension << " 1 " << (dimension == 2 ? 2 : 4) << ' ' << elements.size() << '\n';
    for (std::size_t i = 0; i < elements.size(); ++i) put_corners(text << i + 1, elements[i]);
    text << "$EndElements\n";
    return text.str();
  }
};

/// The mesh of a solid and that of its surface enclose what its tetrahedra have together.
TEST(Msh, RandomSolidsKeepTheirVolume) {
  const std::uint64_t seed = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  Random random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const RandomSolid solid(random);
    for (const bool is_surface : {false, true}) {
      const auto parts = import_msh(solid.text(random, is_surface), "x.msh");
      ASSERT_EQ(parts.parts.size(), 1U) << round;
      ASSERT_NEAR(enclosed_by(parts.parts[0]), solid.volume(), 1e-12 * solid.volume()) << round << is_surface;
    }
  }
}

TEST(Msh, TellsWhatIsWrongAndWhere) {
  EXPECT_EQ(message_of("solid"), "x.msh:1: is no mesh of gmsh: it does not begin with $MeshFormat");
  EXPECT_NE(message_of("$MeshFormat\n4.0 0 8\n").find("x.msh:2: the version 4.0 is not read"),
            std::string::npos);
  EXPECT_NE(message_of(version_2("1\n1 2 2 0 1 1 2 99\n")).find("an element names node 99"),
            std::string::npos);
  EXPECT_NE(message_of(version_2("99999999999\n")).find("tells of 99,999,999,999 elements"),
            std::string::npos);
  EXPECT_NE(message_of(version_2("1\n1 77 2 0 1 1\n")).find("elements of type 77"), std::string::npos);
  EXPECT_NE(message_of(version_2("1\n1 1 2 0 1 1 2\n")).find("no triangles"), std::string::npos);
}

// --- sizes by place ---

std::vector<std::array<double, 4>> sizes_in(const std::string& bytes, const std::string& name) {
  const samples::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / name;
  std::ofstream(file, std::ios::binary) << bytes;
  return read_size_field(file);
}

std::string message_about(const std::string& bytes, const std::string& name) {
  try {
    sizes_in(bytes, name);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string data_section(const std::string& name, const std::string& numbers, int count, int components = 1) {
  return "$" + name + "\n2\n\"how long edges shall be\"\n\"more\"\n1\n0.5\n3\n0\n" +
         std::to_string(components) + "\n" + std::to_string(count) + "\n" + numbers + "$End" + name + "\n";
}

TEST(SizeField, IsReadFromDataOfNodesAndElements) {
  const std::string mesh = version_2("2\n1 4 2 1 1 1 2 3 40\n7 4 2 9 2 1 2 3 5\n");
  using Rows = std::vector<std::array<double, 4>>;
  EXPECT_EQ(sizes_in(mesh + data_section("NodeData", "2 0.25\n40 3\n", 2), "a.msh"),
            (Rows{{1, 0, 0, 0.25}, {0, 0, 1, 3}}));
  EXPECT_EQ(sizes_in(mesh + data_section("NodeData", "2 1 2 3\n", 1, 3) +
                         data_section("ElementData", "7 0.125\n", 1),
                     "a.msh"),
            (Rows{{0.25, 0.25, -0.5, 0.125}}))
      << "vectors are passed over";
  EXPECT_NE(message_about(mesh, "a.msh").find("there are no sizes"), std::string::npos);
  EXPECT_NE(message_about(mesh + data_section("NodeData", "2 -1\n", 1), "a.msh")
                .find("at (1, 0, 0) the size is -1"),
            std::string::npos);
  EXPECT_NE(message_about(mesh + data_section("NodeData", "6 1\n", 1), "a.msh").find("there is no node 6"),
            std::string::npos);
  EXPECT_NE(message_about(mesh + data_section("NodeData", "", 1000000), "a.msh").find("cut off"),
            std::string::npos);
}

TEST(SizeField, IsReadFromBinaryData) {
  std::string bytes = "$MeshFormat\n2.2 1 8\n";
  put(bytes, 1);
  bytes += "\n$EndMeshFormat\n$Nodes\n2\n";
  for (int i = 0; i < 2; ++i) {
    put(bytes, i + 1);
    for (const double x : {1.0 * i, 2.0, 3.0}) put(bytes, x);
  }
  bytes += "\n$EndNodes\n$Elements\n1\n";
  for (const int number : {1, 1, 0, 5, 1, 2}) put(bytes, number);  // a line
  bytes += "\n$EndElements\n$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n";
  for (int i = 0; i < 2; ++i) {
    put(bytes, i + 1);
    put(bytes, 0.5 + i);
  }
  bytes += "\n$EndNodeData\n";
  EXPECT_EQ(sizes_in(bytes, "b.msh"), (std::vector<std::array<double, 4>>{{0, 2, 3, 0.5}, {1, 2, 3, 1.5}}));
}

std::string grid_of_vtk(const std::string& point_data, const std::string& cell_data) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid>"
         "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" "
         "NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>"
         "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray "
         "type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray><DataArray type=\"UInt8\" "
         "Name=\"types\" "
         "format=\"ascii\">10</DataArray></Cells><PointData>" +
         point_data + "</PointData><CellData>" + cell_data +
         "</CellData></Piece></UnstructuredGrid></VTKFile>\n";
}

std::string array_of_vtk(const std::string& name, const std::string& numbers) {
  return "<DataArray type=\"Float64\" Name=\"" + name + "\" format=\"ascii\">" + numbers + "</DataArray>";
}

TEST(SizeField, IsReadFromGridsOfVtk) {
  if (samples::is_sanitized)
    GTEST_SKIP() << "a sanitizer takes more memory than the program that reads it may";
  using Rows = std::vector<std::array<double, 4>>;
  const Rows of_points{{0, 0, 0, 1}, {1, 0, 0, 2}, {0, 1, 0, 3}, {0, 0, 1, 4}},
      of_cells{{0.25, 0.25, 0.25, 5}};
  EXPECT_EQ(sizes_in(grid_of_vtk(array_of_vtk("h", "1 2 3 4"), ""), "a.vtu"), of_points);
  EXPECT_EQ(sizes_in(grid_of_vtk("", array_of_vtk("error", "5")), "a.vtu"), of_cells);
  EXPECT_EQ(sizes_in(grid_of_vtk(array_of_vtk("heat", "1 2 3 4"), array_of_vtk("size", "5")), "a.vtu"),
            of_cells);
  const auto expect_told = [](const std::string& bytes, const std::string& text) {
    EXPECT_NE(message_about(bytes, "a.vtu").find(text), std::string::npos) << message_about(bytes, "a.vtu");
  };
  expect_told(grid_of_vtk(array_of_vtk("heat", "1 2 3 4"), array_of_vtk("error", "5")),
              "None is called 'size', and there are 'heat' of points, 'error' of cells");
  expect_told(grid_of_vtk("", ""), "no array has one number for each point or cell");
  expect_told(grid_of_vtk("", array_of_vtk("size", "0")), "the size is 0");
  expect_told("size 1", "there is no <VTKFile>");
  expect_told(grid_of_vtk("", array_of_vtk("size", "5")).substr(0, 300), "a.vtu: ");
}

}  // namespace
}  // namespace bsp2::model
