// Cells as tetrahedra: none may be flat or inverted, exactly in the coordinates of the file.
#include <gtest/gtest.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPUnstructuredGridReader.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

#include "bsp2/io/outputs/vtu.hpp"
#include "support/rounds.hpp"
#include "support/sample_mesh.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;
using Rational = boost::multiprecision::cpp_rational;
using samples::Point;

/// Six times the volume of a tetrahedron whose first three points go counter-clockwise seen from the fourth.
/// Exact.
Rational six_volumes(const std::array<Point, 4>& p) {
  std::array<std::array<Rational, 3>, 3> m;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) m[i][k] = Rational(p[i + 1][k]) - Rational(p[0][k]);
  Rational sum = 0;
  for (std::size_t k = 0; k < 3; ++k)
    sum += m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3]);
  return sum;
}

double smallest_dihedral(const std::array<Point, 4>& p) {
  const auto minus = [](const Point& a, const Point& b) {
    return Point{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  const auto cross = [](const Point& a, const Point& b) {
    return Point{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  double least = 180;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < 4; ++l) {
        const std::size_t m = 6 - i - k - l;
        if (i >= k || l == i || l == k || m >= l) continue;
        const Point e = minus(p[k], p[i]), u = cross(e, minus(p[l], p[i])), v = cross(e, minus(p[m], p[i]));
        least =
            std::min(least, std::acos(std::clamp(dot(u, v) / std::sqrt(dot(u, u) * dot(v, v)), -1.0, 1.0)) *
                                180 / 3.14159265358979);
      }
  return least;
}

/// Cells that are squeezed and moved until doubles hardly tell their corners apart.
TEST(Simplices, AreNeverFlatOrInverted) {
  const auto seed = samples::new_seed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const samples::TemporaryFolder folder;
  const fs::path file = folder.path() / "solid.pvtu";
  double hardest = 180;
  for (int round = 0; round < samples::all_rounds(12); ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    auto mesh = samples::random_mesh(random, 150);
    const double squeeze = std::pow(10, -round), away = round % 3 == 0 ? 0 : 1000.0;
    double volume = 0;
    std::vector<std::shared_ptr<const geometry::CellBatch>> batches;
    for (const auto& batch : mesh.batches) {
      auto moved = std::make_shared<geometry::CellBatch>(*batch);
      for (std::size_t i = 0; i < moved->points.size(); i += 3) {
        const double turned = 0.6 * moved->points[i] + 0.8 * moved->points[i + 1];
        moved->points[i + 1] = squeeze * (-0.8 * moved->points[i] + 0.6 * moved->points[i + 1]) + away;
        moved->points[i] = turned + away;
      }
      for (double& each : moved->volume) volume += each *= squeeze;
      batches.push_back(moved);
    }
    VtuOptions options;
    options.tets = true;
    VtuShare share(file, 3, batches, options);
    share.write(0, share.size());
    share.publish();
    share.finish();
    vtkNew<vtkXMLPUnstructuredGridReader> reader;
    reader->SetFileName(file.c_str());
    reader->Update();
    vtkUnstructuredGrid* grid = reader->GetOutput();
    ASSERT_EQ(grid->GetNumberOfCells(), static_cast<vtkIdType>(share.simplices().simplices));
    double filled = 0, least = 180;
    int bad = 0;
    for (vtkIdType cell = 0; cell < grid->GetNumberOfCells(); ++cell) {
      vtkNew<vtkIdList> corners;
      grid->GetCellPoints(cell, corners);
      std::array<Point, 4> p;
      for (vtkIdType i = 0; i < 4; ++i)
        grid->GetPoint(corners->GetId(i), p[static_cast<std::size_t>(i)].data());
      const Rational six = six_volumes(p);
      bad += six <= 0;
      filled += static_cast<double>(six) / 6;
      least = std::min(least, smallest_dihedral(p));
    }
    EXPECT_EQ(bad, 0) << "of " << grid->GetNumberOfCells();
    EXPECT_NEAR(share.simplices().smallest_angle, least, 1e-4 + 1e-3 * least);
    // What is left out is told; corners are off by the rounding of `away`.
    const double rounding = 1e-12 * (away + 10) * 1000;
    EXPECT_NEAR(filled + share.simplices().left_out_volume, volume, rounding);
    hardest = std::min(hardest, least);
    if (squeeze > 1e-6) {
      EXPECT_LT(share.simplices().left_out_volume, 1e-9 * volume);
    }
  }
  EXPECT_LT(hardest, 1e-6) << "too easy";
}

}  // namespace
}  // namespace bsp2::io
