#include "bsp2/io/outputs/vtu.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <vtkCell.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPolygon.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPUnstructuredGridReader.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>

#include "bsp2/geometry/support/error.hpp"
#include "support/sample_mesh.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;
using geometry::CellBatch;
using samples::Point;

class Vtu : public ::testing::Test {
 protected:
  vtkSmartPointer<vtkUnstructuredGrid> write_and_read(
      int dimension, const std::vector<std::shared_ptr<const CellBatch>>& batches,
      const VtuOptions& options = {}) {
    write_vtu(file, dimension, batches, options);
    return read();
  }
  vtkSmartPointer<vtkUnstructuredGrid> read() const {
    vtkNew<vtkXMLPUnstructuredGridReader> reader;
    reader->SetFileName(file.c_str());
    reader->Update();
    return reader->GetOutput();
  }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder.path()))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  samples::TemporaryFolder folder;
  fs::path file = folder.path() / "solid.pvtu";
};

/// Volume of a cell by the divergence theorem over the faces that VTK sees; negative if they face inward.
double volume_of(vtkCell* cell) {
  double six = 0;
  for (int f = 0; f < cell->GetNumberOfFaces(); ++f) {
    vtkPoints* points = cell->GetFace(f)->GetPoints();
    Point a{}, b{}, c{};
    points->GetPoint(0, a.data());
    for (vtkIdType i = 2; i < points->GetNumberOfPoints(); ++i) {
      points->GetPoint(i - 1, b.data());
      points->GetPoint(i, c.data());
      six += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
  }
  return six / 6;
}

double value(vtkUnstructuredGrid* grid, const char* array, vtkIdType cell) {
  return grid->GetCellData()->GetArray(array)->GetComponent(cell, 0);
}

std::map<int, int> histogram(vtkUnstructuredGrid* grid) {
  std::map<int, int> types;
  for (vtkIdType i = 0; i < grid->GetNumberOfCells(); ++i) ++types[grid->GetCellType(i)];
  return types;
}

TEST_F(Vtu, WritesTheExactTypeOfEachCell) {
  auto batch = std::make_shared<CellBatch>();
  samples::append(*batch, samples::box({0, 0, 0}, {1, 2, 3}), geometry::Label::in, 4);
  samples::append(*batch, samples::tetrahedron({5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {5, 0, 1}),
                  geometry::Label::fuzzy, -1);
  samples::append(*batch, samples::wedge({0, 5, 0}, {1, 5, 0}, {0, 6, 0}, {0.25, 0, 2}), geometry::Label::out,
                  7);
  samples::append(
      *batch, samples::split(samples::box({0, 0, 0}, {1, 1, 1}), {-2.5, 1, 1, 1})[0]);  // a corner cut off
  const auto grid = write_and_read(3, {batch}, {.rank = 3});
  ASSERT_EQ(grid->GetNumberOfCells(), 4);
  const std::vector<int> types{VTK_HEXAHEDRON, VTK_TETRA, VTK_WEDGE, VTK_POLYHEDRON};
  for (vtkIdType i = 0; i < 4; ++i) {
    const auto cell = static_cast<std::size_t>(i);
    EXPECT_EQ(grid->GetCellType(i), types[cell]);
    EXPECT_NEAR(volume_of(grid->GetCell(i)), batch->volume[cell], 1e-14) << "cell " << i;
    EXPECT_EQ(value(grid, "volume", i), batch->volume[cell]);
    EXPECT_EQ(value(grid, "label", i), static_cast<double>(batch->label[cell]));
    EXPECT_EQ(value(grid, "primitive", i), batch->primitive[cell]);
    EXPECT_EQ(value(grid, "part", i), batch->part[cell]);
    EXPECT_EQ(value(grid, "region", i), batch->region[cell]);
    EXPECT_EQ(value(grid, "level", i), batch->level[cell]);
    EXPECT_EQ(value(grid, "rank", i), 3);
  }
  EXPECT_EQ(grid->GetCellData()->GetArray("label")->GetDataType(), VTK_UNSIGNED_CHAR);
  EXPECT_EQ(grid->GetCellData()->GetArray("part")->GetDataType(), VTK_INT);
  EXPECT_EQ(grid->GetCellData()->GetArray("region")->GetDataType(), VTK_UNSIGNED_INT);
}

TEST_F(Vtu, RandomCellsKeepTheirVolumesThroughPieces) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (const std::size_t cells : {1U, 2U, 50U, 1000U}) {
    const auto mesh = samples::random_mesh(random, cells, 1 + random() % 100);
    const auto grid = write_and_read(3, mesh.batches, {.piece_cells = 1 + random() % 300});
    ASSERT_EQ(grid->GetNumberOfCells(), static_cast<vtkIdType>(mesh.cells));
    double total = 0;
    for (vtkIdType i = 0; i < grid->GetNumberOfCells(); ++i) {
      total += value(grid, "volume", i);
      ASSERT_NEAR(volume_of(grid->GetCell(i)), value(grid, "volume", i), 1e-9)
          << "type " << grid->GetCellType(i);
    }
    EXPECT_NEAR(total, 1000, 1e-8);
  }
}

TEST_F(Vtu, PiecesWithAndWithoutPolyhedraGoTogether) {
  const auto box = samples::box({0, 0, 0}, {1, 1, 1});
  const auto cut = samples::split(samples::box({2, 0, 0}, {3, 1, 1}), {-4.5, 1, 1, 1})[0];
  for (const auto& order :
       {std::vector{box, box, cut, box, cut}, {cut, box, cut, cut, box}, {box, box}, {cut, cut}}) {
    auto batch = std::make_shared<CellBatch>();
    for (const auto& solid : order) samples::append(*batch, solid);
    const auto grid = write_and_read(3, {batch}, {.piece_cells = 1});
    for (vtkIdType i = 0; i < grid->GetNumberOfCells(); ++i) {
      EXPECT_NEAR(volume_of(grid->GetCell(i)), value(grid, "volume", i), 1e-12) << "cell " << i;
    }
  }
}

TEST_F(Vtu, WeldsEqualPointsWithinAPiece) {
  auto batch = std::make_shared<CellBatch>();
  samples::append(*batch, samples::box({-1, 0, 0}, {0.0, 1, 1}));
  samples::append(*batch, samples::box({-0.0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(write_and_read(3, {batch})->GetNumberOfPoints(), 12);
}

TEST_F(Vtu, TetrahedraFillTheCells) {
  std::mt19937 random(5);
  const auto mesh = samples::random_mesh(random, 200);
  const auto grid = write_and_read(3, mesh.batches, {.tets = true});
  EXPECT_EQ(histogram(grid).size(), 1U);
  EXPECT_GT(histogram(grid)[VTK_TETRA], 200);
  double total = 0;
  for (vtkIdType i = 0; i < grid->GetNumberOfCells(); ++i) {
    EXPECT_GT(value(grid, "volume", i), 0);
    ASSERT_NEAR(volume_of(grid->GetCell(i)), value(grid, "volume", i), 1e-9);
    total += value(grid, "volume", i);
  }
  EXPECT_NEAR(total, 1000, 1e-8);
}

TEST_F(Vtu, PolygonsGoAroundInTheirOrder) {
  std::mt19937 random(7);
  auto batch = std::make_shared<CellBatch>();
  samples::append_polygon(*batch, {{0, 0}, {4, 0}, {5, 2}, {2, 4}, {-1, 2}}, random);
  samples::append_polygon(*batch, {{9, 9}, {10, 9}, {9, 10}}, random);
  const auto grid = write_and_read(2, {batch});
  EXPECT_EQ(histogram(grid)[VTK_POLYGON], 2);
  for (vtkIdType i = 0; i < 2; ++i) {
    double normal[3], area = vtkPolygon::ComputeArea(grid->GetCell(i)->GetPoints(),
                                                     grid->GetCell(i)->GetNumberOfPoints(), nullptr, normal);
    EXPECT_NEAR(area, batch->volume[static_cast<std::size_t>(i)], 1e-14);
    EXPECT_GT(normal[2], 0);
  }
  const auto triangles = write_and_read(2, {batch}, {.tets = true});
  EXPECT_EQ(histogram(triangles)[VTK_TRIANGLE], 4);
}

TEST_F(Vtu, WritesLinesAndEmptyMeshesAndRefusesFourDimensions) {
  auto batch = std::make_shared<CellBatch>();
  samples::append_segment(*batch, 1, 3);
  EXPECT_EQ(histogram(write_and_read(1, {batch}))[VTK_LINE], 1);
  EXPECT_EQ(write_and_read(3, {})->GetNumberOfCells(), 0);
  EXPECT_EQ(files(), std::vector<std::string>{"solid.pvtu"});
  EXPECT_THROW(write_vtu(file, 4, {}), Error);
}

TEST_F(Vtu, ASmallerMeshLeavesNoPiecesOfALargerOne) {
  std::mt19937 random(3);
  write_and_read(3, samples::random_mesh(random, 50).batches, {.piece_cells = 10});
  EXPECT_EQ(files().size(), 6U);
  write_and_read(3, samples::random_mesh(random, 15).batches, {.piece_cells = 10});
  EXPECT_EQ(files(), (std::vector<std::string>{"solid.pvtu", "solid_0.vtu", "solid_1.vtu"}));
}

TEST_F(Vtu, AFullDiskLeavesTheOldFilesAndNoOthers) {
  std::mt19937 random(3);
  const auto small = samples::random_mesh(random, 5), large = samples::random_mesh(random, 500);
  write_vtu(file, 3, small.batches);
  const auto before = files();
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);  // NOLINT(*-no-int-to-ptr)
  for (const rlim_t limit : {100U, 20000U, 100000U}) {
    const rlimit tight{limit, old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &tight);
    std::string message;
    try {
      write_vtu(file, 3, large.batches);
    } catch (const Error& error) {
      message = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_NE(message.find("cannot write '" + file.string()), std::string::npos) << message;
  }
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(files(), before);
  EXPECT_EQ(read()->GetNumberOfCells(), 5);
}

TEST_F(Vtu, AMissingFolderIsTheUsersMistake) {
  try {
    write_vtu(folder.path() / "none" / "solid.pvtu", 3, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("none"), std::string::npos) << error.what();
  }
}

TEST_F(Vtu, WritesTheColourOfEachPrimitive) {
  std::mt19937 random(3);
  const auto sample = samples::random_mesh(random, 40);
  auto batch = std::make_shared<CellBatch>(*sample.batches[0]);
  for (std::size_t cell = 0; cell < batch->size(); ++cell) {
    batch->primitive[cell] = static_cast<int>(cell % 3) - 1;
    batch->label[cell] = cell % 5 == 4 ? geometry::Label::fuzzy : geometry::Label::in;
  }
  VtuOptions options;
  options.colour_of_primitive = {{1, 2, 3, 4}, {250, 251, 252, 253}};
  options.part_names = {"a", "b c"};
  options.other_colour = {9, 9, 9, 255};
  options.piece_cells = 7;
  const auto grid = write_and_read(3, {batch}, options);
  vtkDataArray* colours = grid->GetCellData()->GetArray("color");
  ASSERT_NE(colours, nullptr);
  ASSERT_EQ(colours->GetNumberOfComponents(), 4);
  for (vtkIdType i = 0; i < grid->GetNumberOfCells(); ++i) {
    const int primitive = static_cast<int>(value(grid, "primitive", i));
    const bool has_one = primitive >= 0 && value(grid, "label", i) == 1;
    const std::array<std::uint8_t, 4> expected =
        has_one ? options.colour_of_primitive[static_cast<std::size_t>(primitive)] : options.other_colour;
    for (int k = 0; k < 4; ++k) EXPECT_EQ(colours->GetComponent(i, k), expected[static_cast<std::size_t>(k)]);
  }
  EXPECT_EQ(write_and_read(3, {batch})->GetCellData()->GetArray("color"), nullptr);
}

}  // namespace
}  // namespace bsp2::io
