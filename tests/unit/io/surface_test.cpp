// What is written as a surface, read back by VTK's own readers.
#include "bsp2/io/outputs/surface.hpp"

#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;
using geometry::TriangleSurface;

/// A tetrahedron whose corners need all digits, of three parts.
TriangleSurface tetrahedron() {
  TriangleSurface surface;
  surface.points = {{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 0.1, 0}, {1e-3, 0, 1234567.890123}};
  surface.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  surface.owner = {5, geometry::no_primitive, 7, 5};
  return surface;
}

class Surface : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder;
  TriangleSurface surface = tetrahedron();
  std::string warning;
  std::vector<std::string> names;  ///< of parts

  template <typename Reader>
  vtkSmartPointer<vtkPolyData> write_and_read(const char* name) {
    const fs::path file = folder.path() / name;
    warning = write_surface(file, surface, {.names = names}).warning;
    vtkNew<Reader> reader;
    reader->SetFileName(file.c_str());
    reader->Update();
    return reader->GetOutput();
  }

  /// @param precision relative.
  void expect_same(vtkPolyData* read, double precision) {
    ASSERT_EQ(read->GetNumberOfPoints(), static_cast<vtkIdType>(surface.points.size()));
    ASSERT_EQ(read->GetNumberOfCells(), static_cast<vtkIdType>(surface.triangles.size()));
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
      vtkNew<vtkIdList> corners;
      read->GetCellPoints(static_cast<vtkIdType>(i), corners);
      ASSERT_EQ(corners->GetNumberOfIds(), 3);
      for (vtkIdType k = 0; k < 3; ++k) {
        const double* x = read->GetPoint(corners->GetId(k));
        const auto& expected = surface.points[surface.triangles[i][static_cast<std::size_t>(k)]];
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(x[axis], expected[axis], precision * std::fabs(expected[axis]));
      }
    }
  }
  [[nodiscard]] std::string text(const char* name) const {
    std::ifstream in(folder.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

TEST_F(Surface, VtpHoldsAllDigitsAndParts) {
  for (const bool named : {false, true}) {
    if (named) names = std::vector<std::string>(8, "a b");
    const auto read = write_and_read<vtkXMLPolyDataReader>("a.vtp");
    expect_same(read, 0);
    vtkDataArray* owner = read->GetCellData()->GetArray("part");
    ASSERT_NE(owner, nullptr);
    for (std::size_t i = 0; i < surface.owner.size(); ++i)
      EXPECT_EQ(owner->GetComponent(static_cast<vtkIdType>(i), 0), surface.owner[i]);
    auto* const all_names =
        vtkStringArray::SafeDownCast(read->GetFieldData()->GetAbstractArray("part_names"));
    ASSERT_EQ(all_names != nullptr, named);
    if (named) {
      EXPECT_EQ(all_names->GetValue(7), "a b");
    }
  }
}

TEST_F(Surface, StlIsReadAsWritten) { expect_same(write_and_read<vtkSTLReader>("a.STL"), 1e-7); }

TEST_F(Surface, StlLeavesOutWhatSinglePrecisionCollapses) {
  surface.points.push_back({-1, 1, 1});  // over the side 2 0 3
  surface.triangles.pop_back();
  surface.triangles.insert(surface.triangles.end(), {{2, 0, 4}, {0, 3, 4}, {3, 2, 4}});
  surface.owner.assign(6, 0);
  surface.points[1] = {0, 1e-3, 1e-60};
  surface.points[2] = {0, 1e-3, 0};
  // Two triangles have two corners in one; two others come to lie on each other, back to back. Three are left
  // with one that is gone.
  const auto read = write_and_read<vtkSTLReader>("a.stl");
  EXPECT_EQ(read->GetNumberOfCells(), 4);
  EXPECT_EQ(read->GetNumberOfPoints(), 4);
}

// Far from the origin, or large, single precision does not do: who gets the file has to know.
TEST_F(Surface, WhatSinglePrecisionSpoilsIsTold) {
  write_and_read<vtkSTLReader>("a.stl");
  EXPECT_EQ(warning, "");
  for (auto& point : surface.points) point = {point[0] + 1e5, point[1], point[2] / 1234567.890123};
  write_and_read<vtkSTLReader>("a.stl");
  EXPECT_NE(warning.find("single precision"), std::string::npos);
  write_and_read<vtkPLYReader>("a.ply");
  EXPECT_EQ(warning, "");
  surface.points[3][2] = 1e39;
  EXPECT_THROW(static_cast<void>(write_surface(folder.path() / "large.stl", surface)), Error);
  EXPECT_FALSE(fs::exists(folder.path() / "large.stl"));
}

// Readers compare the two. Slivers are turned over by rounding, so the normal has to be that of what is
// written.
TEST_F(Surface, NormalsOfStlAreThoseOfTheCornersWritten) {
  const auto seed = samples::new_seed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  surface = {};
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const std::array<double, 3> a{number(random), number(random), number(random)},
        b{number(random), number(random), number(random)};
    std::array<double, 3> c;
    for (int k = 0; k < 3; ++k) c[k] = (a[k] + b[k]) / 2 + 1e-8 * number(random);
    surface.points.insert(surface.points.end(), {a, b, c});
    surface.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    surface.owner.push_back(0);
  }
  ASSERT_EQ(write_surface(folder.path() / "a.stl", surface).warning, "");
  const std::string bytes = text("a.stl");
  const std::size_t count = (bytes.size() - 84) / 50;
  ASSERT_GT(count, 900U);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<std::array<float, 3>, 4> t;  // the normal, the corners
    std::memcpy(t.data(), bytes.data() + 84 + 50 * i, sizeof t);
    double along = 0;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      const auto edge = [&](int corner, int axis) {
        return static_cast<double>(t[corner][axis]) - t[1][axis];
      };
      along += t[0][k] * (edge(2, l) * edge(3, m) - edge(2, m) * edge(3, l));
    }
    EXPECT_GE(along, 0) << i;
  }
}

TEST_F(Surface, PlyIsReadAsWritten) {
  expect_same(write_and_read<vtkPLYReader>("a.ply"), 1e-7);  // VTK's reader rounds
  const std::string bytes = text("a.ply");
  EXPECT_NE(bytes.find("property double z"), std::string::npos);
  const auto body = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size(), body + 4 * 24 + 4 * (1 + 12 + 4));
  double x = 0;
  std::int32_t part = 0;
  std::memcpy(&x, bytes.data() + body + 3 * 24 + 16, sizeof x);
  std::memcpy(&part, bytes.data() + body + 4 * 24 + 2 * 17 + 13, sizeof part);
  EXPECT_EQ(x, 1234567.890123);
  EXPECT_EQ(part, 7);
  names = {"", "a\nb"};
  surface.owner = {0, 1, 1, 0};
  expect_same(write_and_read<vtkPLYReader>("b.ply"), 1e-7);
  EXPECT_NE(text("b.ply").find("comment part 1 a b\n"), std::string::npos);
}

TEST_F(Surface, ObjHoldsAllDigitsAndAGroupForEachPart) {
  surface.triangles = {surface.triangles[1], surface.triangles[0], surface.triangles[3],
                       surface.triangles[2]};  // as they are written: by owner
  surface.owner = {geometry::no_primitive, 5, 5, 7};
  expect_same(write_and_read<vtkOBJReader>("a.obj"), 1e-7);
  const std::string all = text("a.obj");
  EXPECT_NE(all.find("v 0.001 0 1234567.890123\n"), std::string::npos);
  EXPECT_NE(all.find("g no_part\nf 1 2 4\ng part_5\nf 1 3 2\nf 3 1 4\ng part_7\nf 2 3 4\n"),
            std::string::npos);
  surface.owner = {geometry::no_part, 0, 1, 2};
  names = {"left leg", "left_leg", ""};
  expect_same(write_and_read<vtkOBJReader>("b.obj"), 1e-7);
  EXPECT_NE(
      text("b.obj").find("g no_part\nf 1 2 4\ng left_leg\nf 1 3 2\ng left_leg_1\nf 3 1 4\ng _2\nf 2 3 4\n"),
      std::string::npos);
  names = {"no_part", "a", "b"};
  expect_same(write_and_read<vtkOBJReader>("c.obj"), 1e-7);
  EXPECT_NE(text("c.obj").find("g no_part\nf 1 2 4\ng no_part_0\nf 1 3 2\ng a\n"), std::string::npos);
}

/// A tetrahedron of three parts, two of them with a colour.
TEST_F(Surface, ColoursOfPartsAreThoseOfTriangles) {
  surface.owner = {0, 2, 1, geometry::no_part};
  SurfaceParts parts;
  parts.names = {"a", "b", "c"};
  parts.colours = {std::array<std::uint8_t, 4>{1, 2, 3, 255}, std::nullopt,
                   std::array<std::uint8_t, 4>{4, 5, 6, 128}};
  parts.other_colour = {7, 8, 9, 255};
  const std::vector<std::array<int, 4>> expected{
      {1, 2, 3, 255}, {4, 5, 6, 128}, {7, 8, 9, 255}, {7, 8, 9, 255}};
  for (const SurfaceFormat& format : surface_formats()) {
    if (format.has_faces || format.is_plane) continue;
    const auto file = folder.path() / ("c" + std::string(format.ending));
    EXPECT_TRUE(write_surface(file, surface, parts).notes.empty()) << file;
  }
  vtkNew<vtkXMLPolyDataReader> vtp;
  vtp->SetFileName((folder.path() / "c.vtp").c_str());
  vtp->Update();
  vtkDataArray* color = vtp->GetOutput()->GetCellData()->GetArray("color");
  ASSERT_NE(color, nullptr);
  const std::string ply = text("c.ply");
  const std::size_t faces = ply.size() - 4 * 21;
  for (std::size_t i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(color->GetComponent(static_cast<vtkIdType>(i), k), expected[i][k]);
      EXPECT_EQ(static_cast<unsigned char>(ply[faces + 21 * i + 17 + k]), expected[i][k]);
    }
  EXPECT_NE(text("c.off").find("\n3 0 2 1 1 2 3\n3 0 1 3 4 5 6 128\n3 1 2 3 7 8 9\n"), std::string::npos);
  EXPECT_NE(text("c.obj").find("mtllib c.mtl\n"), std::string::npos);
  EXPECT_NE(text("c.obj").find("g c\nusemtl c\n"), std::string::npos);
  EXPECT_NE(text("c.mtl").find("newmtl c\n"), std::string::npos);
  EXPECT_EQ(text("c.stl").size(), 84U + 4 * 50);
}

/// Two tetrahedra with a common face.
TEST_F(Surface, PartsThatTouchAreObjectsOfTheirOwnForPrinters) {
  surface.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}};
  surface.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3},
                       {0, 1, 2}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}};
  surface.owner = {0, 0, 0, 0, 1, 1, 1, 1};
  surface.closes_parts = true;
  SurfaceParts parts;
  parts.names = {"a]]>", "b"};
  parts.colours = {std::array<std::uint8_t, 4>{1, 2, 3, 255}, std::nullopt};
  for (const std::string name : {"t.amf", "t.3mf"})
    EXPECT_TRUE(write_surface(folder.path() / name, surface, parts).notes.empty()) << name;
  const std::string amf = text("t.amf");
  const auto count = [&](const std::string& word) {
    std::size_t found = 0;
    for (std::size_t at = amf.find(word); at != std::string::npos; at = amf.find(word, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<object "), 2U);
  EXPECT_EQ(count("<vertex>"), 8U);
  EXPECT_EQ(count("<triangle>"), 8U);
  EXPECT_EQ(count("<volume materialid=\"1\">"), 1U);
  // No text of XML has what ends a CDATA section.
  EXPECT_EQ(count(">a]]&gt;<"), 2U);
  EXPECT_EQ(count(">b<"), 1U);
}

TEST_F(Surface, AnEmptyOneCanBeWritten) {
  surface = {};
  EXPECT_EQ(write_and_read<vtkXMLPolyDataReader>("a.vtp")->GetNumberOfCells(), 0);
  for (const SurfaceFormat& format : surface_formats()) {
    if (format.has_faces || format.is_plane) continue;  // these cannot hold nothing
    const std::string name = "a" + std::string(format.ending);
    const SurfaceRemarks remarks = write_surface(folder.path() / name, surface);
    EXPECT_TRUE(remarks.warning.empty() && remarks.notes.empty()) << name;
    EXPECT_FALSE(text(name.c_str()).empty()) << name;
  }
}

/// Of all that is written it is read, or known that it is not.
TEST_F(Surface, WhatIsWrittenIsReadAsAModelOrRefusedByItsName) {
  std::istringstream words(surface_endings() + " " + solver_endings() + " .pvtu");
  std::string word;
  unsigned read = 0, refused = 0;
  while (words >> word) {
    if (word.front() != '.') continue;
    const std::string ending = word.substr(0, word.find(','));
    if (ending == ".foam") continue;  // the mark of a folder
    const auto path = folder.path() / ("solid" + ending);
    std::ofstream(path) << "what another program reads";
    if (model::is_imported(path)) {
      ++read;
      continue;
    }
    try {
      model::read_model_text(path);
      FAIL() << path << " is taken for the text of a model";
    } catch (const Error& error) {
      ++refused;
      EXPECT_TRUE(std::string(error.what())
                      .starts_with(path.string() + ": files named *" + ending +
                                   " are written, but not read; .3mf, .amf, "))
          << error.what();
    }
  }
  EXPECT_GE(read, 14U);
  EXPECT_EQ(refused, 7U);
}

TEST_F(Surface, OtherEndingsAndMissingFoldersAreErrors) {
  EXPECT_EQ(surface_format("a.vtu"), nullptr);
  EXPECT_EQ(surface_format("stl"), nullptr);
  EXPECT_EQ(surface_format("x/a.PLY")->ending, ".ply");
  EXPECT_THROW(static_cast<void>(write_surface(folder.path() / "a.vtu", surface)), Error);
  for (const SurfaceFormat& format : surface_formats())
    EXPECT_THROW(static_cast<void>(
                     write_surface(folder.path() / "none" / ("a" + std::string(format.ending)), surface)),
                 Error);
}

}  // namespace
}  // namespace bsp2::io
