// Drawings: areas that OpenSCAD 2021.01 gives for the same files.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "imports.hpp"
#include "temporary_folder.hpp"

namespace bsp2::model {
namespace {

/// The area of paths that do not overlap.
double area_of(const PlaneDrawing& drawing) {
  double sum = 0;
  for (std::size_t f = 0; f < drawing.paths.size(); ++f) {
    const auto path = drawing.paths[f];
    double twice = 0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const auto &p = drawing.points[path[i]], &q = drawing.points[path[(i + 1) % path.size()]];
      twice += p[0] * q[1] - p[1] * q[0];
    }
    sum += std::fabs(twice) / 2;
  }
  return sum;
}

double svg_area(const std::string& elements) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.svg";
  std::ofstream(path) << "<svg width=\"100mm\" height=\"100mm\" viewBox=\"0 0 100 100\">" << elements << "</svg>";
  double sum = 0;
  for (const PlaneDrawing& drawing : import_svg(path, 72, {})) sum += area_of(drawing);
  return sum;
}

TEST(Svg, LinesAreAsWideAsTheirStrokes) {
  const std::string line = "<line x1=\"10\" y1=\"10\" x2=\"30\" y2=\"10\" ", path = "<path d=\"M10 10 L30 10 L30 30\" ";
  EXPECT_NEAR(svg_area(line + "stroke-width=\"2\"/>"), 44, 1e-9) << "with square caps";
  EXPECT_NEAR(svg_area(path + "stroke-width=\"2\" fill=\"none\"/>"), 84, 1e-9) << "and a mitre";
  EXPECT_NEAR(svg_area(path + "/>"), 41, 1e-9) << "1 wide if nothing is said";
  EXPECT_NEAR(svg_area(path + "style=\"stroke-width:2;stroke-linecap:butt\"/>"), 80, 1e-9);
  EXPECT_NEAR(svg_area(path + "style=\"stroke-width:2;stroke-linecap:round;stroke-linejoin:round\"/>"), 82.92688, 1e-4);
  EXPECT_NEAR(svg_area("<g transform=\"scale(2)\">" + line + "stroke-width=\"2\"/></g>"), 176, 1e-9);
  EXPECT_NEAR(svg_area("<g stroke-width=\"2\">" + line + "/></g>"), 21, 1e-9) << "not inherited";
  EXPECT_NEAR(svg_area("<path d=\"M10 10 L30 10 L30 30 Z\" style=\"stroke-width:2\" fill=\"none\"/>"), 200, 1e-9) << "an area has no stroke";
  EXPECT_EQ(svg_area("<defs><rect id=\"a\" width=\"3\" height=\"2\"/></defs><use href=\"#a\"/>"), 0);
}

TEST(Dxf, BlocksAreInsertedAndBulgesPassedOver) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.dxf";
  const auto write = [&](std::initializer_list<const char*> lines) {
    std::ofstream file(path);
    for (const char* line : lines) file << line << '\n';
  };
  write({"0", "SECTION", "2", "BLOCKS", "0", "BLOCK", "8", "0", "2", "B1", "10", "0", "20", "0",                                       //
         "0", "LWPOLYLINE", "8", "0", "70", "1", "10", "0", "20", "0", "10", "2", "20", "0", "42", "0.5", "10", "2", "20", "1", "10", "0", "20", "1",  //
         "0", "ENDBLK", "0", "ENDSEC", "0", "SECTION", "2", "ENTITIES",                                                                 //
         "0", "INSERT", "8", "0", "2", "B1", "10", "10", "20", "5", "41", "2", "42", "3", "50", "30",                                     //
         "0", "INSERT", "8", "0", "2", "B1", "10", "-10", "20", "5",                                                                    //
         "0", "ELLIPSE", "8", "0", "10", "0", "20", "-20", "11", "4", "21", "3", "40", "0.5", "41", "0", "42", "6.283185307",               //
         "0", "ENDSEC", "0", "EOF"});
  // OpenSCAD gives 52.819: it moves points to a grid of 0.00095.
  EXPECT_NEAR(area_of(import_dxf(path, "", {.fn = 24})), 12 + 2 + 12 * sine(15) * 5 * 2.5, 1e-6);
  // An arc whose angles are far apart ends all the same.
  write({"0", "SECTION", "2", "ENTITIES", "0", "ARC", "10", "0", "20", "0", "40", "1", "50", "1e300", "51", "0", "0", "ENDSEC", "0", "EOF"});
  EXPECT_EQ(import_dxf(path, "", {}).paths.size(), 0U);
}

}  // namespace
}  // namespace bsp2::model
