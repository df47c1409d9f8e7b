// No file of any format, and nothing that is printed, has a zero with a sign: to readers it is a number of
// its own.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include "bsp2/io/outputs/surface.hpp"
#include "support/command.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

class SignedZeros : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;

  std::string at(const std::string& name) { return (folder_.path() / name).string(); }
  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(at(name)) << text;
    return at(name);
  }
  /// @return what was printed.
  static std::string bsp2(const std::string& arguments) {
    return bsp2::samples::printed(BSP2_PROGRAM " " + arguments);
  }
  static std::string bytes(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

void expect_none_in_text(const std::string& text, const std::string& name) {
  static const std::regex zero(R"((^|[^\w.\-])-0(\.0*)?(e[+-]?\d+)?(?![\d.\w]))", std::regex::optimize);
  std::smatch match;
  EXPECT_FALSE(std::regex_search(text, match, zero))
      << name << ": ..."
      << match.prefix().str().substr(
             match.prefix().length() > 40 ? static_cast<std::size_t>(match.prefix().length()) - 40 : 0)
      << match.str();
}

/// Real numbers that follow each other, `count` of them in every `stride` bytes.
template <typename Real>
void expect_none_in(const std::string& data, std::size_t first, std::size_t stride, std::size_t count,
                    const std::string& name) {
  for (std::size_t begin = first; begin + count * sizeof(Real) <= data.size(); begin += stride)
    for (std::size_t i = 0; i < count; ++i) {
      Real x;
      std::memcpy(&x, data.data() + begin + i * sizeof(Real), sizeof x);
      ASSERT_FALSE(x == 0 && std::signbit(x)) << name << ": byte " << begin + i * sizeof(Real);
    }
}

/// Where coordinates, normals and integrals would have one: turned by quarters, mirrored, about the origin.
const std::string solid =
    "part(\"a\") color([1, 0, 0]) multmatrix([[0,-1,0,0],[1,0,0,0],[0,0,-1,0],[0,0,0,1]]) "
    "difference() { cube(size=[2, 2, 2], center=true); cube(size=[1, 1, 4], center=true); }"
    "part(\"b\") multmatrix([[-1,0,0,0],[0,-1,0,0],[0,0,1,1],[0,0,0,1]]) cube(size=[1, 1, 1], center=false);"
    "multmatrix([[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) sphere(r=0.5, $fn=8);";
const std::string plane =
    "multmatrix([[0,-1,0,0],[-1,0,0,0],[0,0,1,0],[0,0,0,1]]) difference() "
    "{ square(size=[4, 4], center=true); circle(r=1, $fn=8); }";

void expect_none_in_surface(const std::string& data, const std::string& ending) {
  if (ending == ".stl") return expect_none_in<float>(data, 84, 50, 12, ending);
  if (ending == ".ply") {
    const std::size_t end = data.find("end_header\n");
    ASSERT_NE(end, std::string::npos);
    const std::string header = data.substr(0, end);
    expect_none_in_text(header, ending);
    const auto points = std::stoul(header.substr(header.find("element vertex ") + 15));
    ASSERT_NE(header.find("property double z"), std::string::npos);
    return expect_none_in<double>(data.substr(end + 11, points * 24), 0, 24, 3, ending);
  }
  if (ending ==
      ".glb") {  // a chunk of JSON, then the buffer: positions and normals, and indices, which are no -0
    std::uint32_t length = 0;
    std::memcpy(&length, data.data() + 12, 4);
    expect_none_in_text(data.substr(20, length), ending);
    return expect_none_in<float>(data.substr(28 + length), 0, 4, 1, ending);
  }
  if (ending == ".3mf" || ending == ".amf" || ending == ".pdf")
    return;  // packed: their writers are those of text
  expect_none_in_text(data, ending);
}

TEST_F(SignedZeros, AreInNoSurface) {
  std::string of_solid = "run " + file("solid.csg", solid), of_plane = "run " + file("plane.csg", plane);
  std::vector<std::string> endings;
  for (const auto& format : bsp2::io::surface_formats()) {
    if (format.has_faces) continue;  // their axes are what Open CASCADE computes for itself
    const std::string ending(format.ending);
    endings.push_back(ending);
    (format.is_plane ? of_plane : of_solid) += " --boundary " + at("surface" + ending);
  }
  expect_none_in_text(bsp2(of_solid + " --stats --report " + at("report.json")), "what is printed");
  expect_none_in_text(bsp2(of_plane), "what is printed");
  expect_none_in_text(bytes(at("report.json")), "report.json");
  for (const std::string& ending : endings) {
    ASSERT_TRUE(fs::exists(at("surface" + ending))) << ending;
    expect_none_in_surface(bytes(at("surface" + ending)), ending);
  }
  expect_none_in_text(bytes(at("surface.mtl")), ".mtl");
}

TEST_F(SignedZeros, AreInNoMeshDrawingOrTable) {
  const std::string model = file("solid.csg", solid);
  for (const std::string name : {"mesh.msh", "mesh.inp"}) {
    expect_none_in_text(bsp2("mesh " + model + " --size 0 -o " + at(name)), "what is printed");
    expect_none_in_text(bytes(at(name)), name);
  }
  bsp2("mesh " + model + " --msh-version 2.2 --size 0 -o " + at("old.msh"));
  expect_none_in_text(bytes(at("old.msh")), "old.msh");
  bsp2("mesh " + model + " -o " + at("case"));
  for (const auto& entry : fs::recursive_directory_iterator(at("case")))
    if (entry.is_regular_file()) expect_none_in_text(bytes(entry.path()), entry.path().filename().string());
  for (const std::string name : {"sheet.svg", "sheet.dxf"}) {
    bsp2("draw " + model + " --section A=y:0 --date 2020-02-02 -o " + at(name));
    expect_none_in_text(bytes(at(name)), name);
  }
  bsp2("run " + model + " --picture " + at("view.svg") + " --table " + at("table.csv"));
  expect_none_in_text(bytes(at("view.svg")), "view.svg");
  expect_none_in_text(bytes(at("table.csv")), "table.csv");
  bsp2("run " + model + " --snapshot " + at("run.h5"));
  expect_none_in_text(
      bsp2("query " + at("run.h5") + " --points " + file("points.txt", "0 0 0\n0.25 0.25 0.6\n")), "query");
  expect_none_in_text(bsp2("info " + at("run.h5")), "info");
}

}  // namespace
