// Outlines of plane models and drawings of solids, read back by the program itself and by others.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/dataflow/constructs/part_outlines.hpp"
#include "bsp2/error.hpp"
#include "bsp2/io/outputs/outline.hpp"
#include "models.hpp"
#include "support/command.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;
using Outlines = std::vector<geometry::PartOutline>;

using samples::Ended;

Ended bsp2(const std::string& arguments) { return samples::run_command(BSP2_PROGRAM " " + arguments); }

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Drawings : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder_;

  std::string file(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() / name) << content;
    return (folder_.path() / name).string();
  }
  std::string at(const std::string& name) { return (folder_.path() / name).string(); }
  double size_of(const std::string& text) { return run_file(file("read.csg", text)).in_volume; }
};

double area_of(const Outlines& outlines) {
  double twice = 0;
  for (const auto& outline : outlines)
    for (const auto& path : outline.paths)
      for (std::size_t i = 0; i < path.corners.size(); ++i) {
        const auto &p = path.corners[i], &q = path.corners[(i + 1) % path.corners.size()];
        twice += p[0] * q[1] - p[1] * q[0];
      }
  return twice / 2;
}

double length_of(const Outlines& outlines) {
  double length = 0;
  for (const auto& outline : outlines)
    for (const auto& path : outline.paths)
      for (std::size_t i = 0; i < path.corners.size(); ++i) {
        const auto &p = path.corners[i], &q = path.corners[(i + 1) % path.corners.size()];
        length += std::hypot(q[0] - p[0], q[1] - p[1]);
      }
  return length;
}

TEST_F(Drawings, OfPlaneSolidsHaveTheirAreaWhenReadAgain) {
  constexpr double grid = 1.0 / 1024;  // of what reads DXF
  std::size_t empty = 0;
  const unsigned rounds = samples::rounds(40U);
  for (unsigned seed = 1; seed <= rounds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    dataflow::Random random(seed);
    const auto network = dataflow::compile<2>(
        dataflow::random_expression(random, 2, dataflow::Kind::solids, 2 + static_cast<int>(seed % 2)), {});
    const auto evaluated = dataflow::evaluate_all(network, 0, {});
    std::vector<std::shared_ptr<const geometry::CellBatch>> batches;
    for (const auto& refinement : evaluated.refinements) batches.emplace_back(refinement, &refinement->cells);
    const double area = evaluated.evaluation.totals.in.value().volume();
    const Outlines outlines = dataflow::part_outlines(network, batches);
    EXPECT_NEAR(area_of(outlines), area, 1e-9 * (1 + area));
    if (outlines.empty()) {
      EXPECT_THROW(static_cast<void>(io::write_outline(at("o.svg"), outlines)), Error);
      ++empty;
      continue;
    }
    static_cast<void>(io::write_outline(at("o.svg"), outlines));
    EXPECT_NEAR(size_of("import(\"o.svg\");"), area, 1e-8 * (1 + area));
    static_cast<void>(io::write_outline(at("o.dxf"), outlines));
    EXPECT_NEAR(size_of("import(\"o.dxf\");"), area, grid * length_of(outlines));
  }
  EXPECT_LT(empty, rounds / 2);
}

constexpr auto plane_parts =
    "part(\"plate\") color([1, 0, 0, 1]) difference() { square([20, 10]); circle(r=3, $fn=30); }\n"
    "part(\"ring ø 16\") multmatrix([[1,0,0,40],[0,1,0,-3],[0,0,1,0],[0,0,0,1]]) difference() { circle(r=8, "
    "$fn=60); "
    "circle(r=5, $fn=50); }";

TEST_F(Drawings, OfPlaneSolidsHaveALayerAPart) {
  const std::string model = file("model.csg", plane_parts);
  const Ended ended = bsp2("run " + model + " --boundary " + at("o.dxf") + " --boundary " + at("o.svg") +
                           " --boundary " + at("o.pdf"));
  ASSERT_EQ(ended.code, 0) << ended.text;
  EXPECT_NE(ended.text.find("o.svg: the page begins at the lower left corner"), std::string::npos)
      << ended.text;
  const auto parts = run_file(model).named_parts;
  ASSERT_EQ(parts.size(), 2U);
  const auto area = [&](const std::string& layer) {
    return size_of("import(\"o.dxf\", layer=\"" + layer + "\");");
  };
  EXPECT_NEAR(area("plate"), parts[0].volume, 0.1);
  EXPECT_NEAR(area("ring ø 16"), parts[1].volume, 0.1);
  EXPECT_NEAR(size_of("import(\"o.svg\", id=\"ring ø 16\");"), parts[1].volume, 1e-6);
  EXPECT_EQ(bytes_of(at("o.pdf")).substr(0, 5), "%PDF-");
  // Whoever computes it.
  for (const std::string threads : {"1", "2"})
    ASSERT_EQ(
        bsp2("run " + model + " --regions 16 --boundary " + at(threads + ".dxf") + " --threads " + threads)
            .code,
        0);
  EXPECT_EQ(bytes_of(at("1.dxf")), bytes_of(at("2.dxf")));
}

TEST_F(Drawings, OfCirclesHaveArcsIfTheyAreRound) {
  const std::string model =
      file("model.csg",
           "difference() { square([40, 20]); circle(r=6); multmatrix([[1,0,0,20],[0,1,0,10],"
           "[0,0,1,0],[0,0,0,1]]) circle(r=5); }");
  const std::string outputs = " --boundary " + at("o.svg") + " --boundary " + at("o.dxf") + " --quiet";
  ASSERT_EQ(bsp2("run " + model + outputs).code, 0);
  EXPECT_EQ(bytes_of(at("o.svg")).find('A'), std::string::npos);
  EXPECT_EQ(bytes_of(at("o.dxf")).find("CIRCLE"), std::string::npos);
  const Ended ended =
      bsp2("run " + model + " --curved --boundary " + at("p.pdf") + outputs.substr(0, outputs.size() - 8));
  ASSERT_EQ(ended.code, 0) << ended.text;
  EXPECT_NE(ended.text.find("o.svg: 2 arcs of circles, as in the model\n"), std::string::npos) << ended.text;
  const std::string svg = bytes_of(at("o.svg")), dxf = bytes_of(at("o.dxf"));
  EXPECT_NE(svg.find("M15 -10A5 5 0 0 1 25 -10A5 5 0 0 1 15 -10z"), std::string::npos) << svg;
  EXPECT_NE(dxf.find("CIRCLE"), std::string::npos);
  const double area = 800 - std::numbers::pi * (9 + 25);
  EXPECT_NEAR(size_of("import(\"o.dxf\", $fn=720);"), area, 0.05);
  EXPECT_NEAR(size_of("import(\"o.svg\");"), area, 3);
  for (const std::string regions : {"1", "16"})
    for (const std::string threads : {"1", "2"}) {
      ASSERT_EQ(
          bsp2("run " + model + " --curved --regions " + regions + " --threads " + threads + outputs).code,
          0);
      EXPECT_EQ(bytes_of(at("o.svg")), svg) << regions;
      EXPECT_EQ(bytes_of(at("o.dxf")), dxf) << regions;
    }
}

#ifdef BSP2_MPIEXEC
TEST_F(Drawings, OfCirclesAreTheSameOnAnyNumberOfRanks) {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  const std::string model =
      file("model.csg",
           "part(\"plate\") difference() { square([20, 10]); circle(r=3); }\n"
           "part(\"pin\") circle(r=3);\n"
           "part(\"oval\") multmatrix([[1,0,0,40],[0,2,0,0],[0,0,1,0],[0,0,0,1]]) circle(r=4);");
  std::string one;
  for (int ranks = 1; ranks <= 4; ++ranks) {
    const Ended ended = samples::run_command(
        BSP2_MPIEXEC " --oversubscribe -n " + std::to_string(ranks) + " " BSP2_PROGRAM " run " + model +
        " --curved --regions 8 --threads 1 --quiet --boundary " + at("o.svg"));
    ASSERT_EQ(ended.code, 0) << ended.text;
    if (ranks == 1) one = bytes_of(at("o.svg"));
    EXPECT_EQ(bytes_of(at("o.svg")), one) << ranks;
  }
  EXPECT_NE(one.find("A3 3 0 0 "), std::string::npos);
}
#endif

TEST_F(Drawings, AreRefusedInOneSentence) {
  const std::string solid = file("solid.csg", "cube(size=[40, 20, 10]);"),
                    plane = file("plane.csg", "square([2, 1]);");
  const std::array<std::array<std::string, 2>, 10> all{{
      {"run " + solid + " --boundary " + at("x.svg"), "this one is solid; 'bsp2 draw' makes drawings of it"},
      {"run " + plane + " --boundary " + at("x.stl"),
       "outlines of plane models are written as .dxf, .pdf or .svg"},
      {"draw " + plane + " -o " + at("x.svg"),
       "'bsp2 run MODEL --boundary FILE' writes the outline of a plane model"},
      {"draw " + solid + " -o " + at("x.png"), "must end in .svg, .pdf or .dxf"},
      {"draw " + solid + " -o " + at("x.svg") + " --views front,side", "there is no view 'side'"},
      {"draw " + solid + " -o " + at("x.svg") + " --section A=x:40",
       "the plane x = 40 does not cut the solid"},
      {"draw " + solid + " -o " + at("x.svg") + " --section A=w:4", "is no section"},
      {"draw " + solid + " -o " + at("x.svg") + " --scale 50:1", "the views do not fit on A3: "},
      {"draw " + solid + " -o " + at("x.svg") + " --dimension back:0,0,0:1,0,0", "add it to --views"},
      {"draw " + solid + " -o " + at("x.svg") + " --dimension front:0,0,0:9000,0,0", "leads off the sheet"},
  }};
  for (const auto& [arguments, expected] : all) {
    const Ended ended = bsp2(arguments);
    EXPECT_EQ(ended.code, 2) << arguments;
    EXPECT_NE(ended.text.find(expected), std::string::npos) << ended.text;
    EXPECT_FALSE(fs::exists(at("x.svg")));
  }
}

TEST_F(Drawings, OfABoxHaveItsRectangle) {
  const std::string solid = file("solid.csg", "cube(size=[40, 20, 10]);");
  const std::array<std::pair<std::string, double>, 3> views{{{"front", 400}, {"left", 200}, {"bottom", 800}}};
  for (const auto& [view, area] : views) {
    const Ended ended = bsp2("draw " + solid + " -o " + at("x.dxf") + " --scale 1:2 --views " + view);
    ASSERT_EQ(ended.code, 0) << ended.text;
    EXPECT_NEAR(size_of("import(\"x.dxf\", layer=\"VISIBLE\");"), area / 4, 1e-6);
  }
}

/// Together, of all lines in a layer of a DXF file.
double length_in(const fs::path& path, const std::string& layer) {
  std::istringstream text(bytes_of(path));
  std::string code, value, kind, name;
  std::array<double, 4> ends{};
  double length = 0;
  const auto finish = [&] {
    if (kind == "LINE" && name == layer) length += std::hypot(ends[2] - ends[0], ends[3] - ends[1]);
  };
  while (std::getline(text, code) && std::getline(text, value)) {
    const int number = std::stoi(code);
    if (number == 0) {
      finish();
      kind = value;
      name.clear();
    }
    if (number == 8) name = value;
    if (number == 10 || number == 11) ends[number == 10 ? 0 : 2] = std::stod(value);
    if (number == 20 || number == 21) ends[number == 20 ? 1 : 3] = std::stod(value);
  }
  return length;
}

std::string random_solid(std::mt19937& random) {
  std::uniform_real_distribution<double> place(0, 100), size(20, 60);
  const auto some = [&](int count) {
    std::ostringstream text;
    for (int i = 0; i < count; ++i) {
      text << "multmatrix([[1,0,0," << place(random) << "],[0,1,0," << place(random) << "],[0,0,1,"
           << place(random) / 4 << "],[0,0,0,1]]) ";
      if (random() % 2 == 0)
        text << "cube(size=[" << size(random) << ", " << size(random) << ", " << size(random) << "]);\n";
      else
        text << "cylinder(h=" << size(random) << ", r1=" << size(random) / 2 << ", r2=" << size(random) / 2
             << ", $fn=32);\n";
    }
    return text.str();
  };
  return "difference() { union() {" + some(4) + "} " + some(2) + "}\n";
}

TEST_F(Drawings, HatchWhatASectionCuts) {
  for (unsigned seed = 1; seed <= samples::rounds(6U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const std::string text = random_solid(random), solid = file("solid.csg", text);
    const double height = 20 + static_cast<double>(random() % 100) / 17;
    const Ended ended =
        bsp2("draw " + solid + " -o " + at("s.dxf") + " --views top --sheet A1 --scale 1:1 --section A=" +
             (seed % 2 == 0 ? "-z:" : "z:") + std::to_string(height));
    ASSERT_EQ(ended.code, 0) << ended.text;
    const double area = size_of("projection(cut=true) multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,-" +
                                std::to_string(height) + "],[0,0,0,1]]) {" + text + "}");
    EXPECT_NEAR(2.5 * length_in(at("s.dxf"), "SECTION"), area, 0.03 * area + 20);
  }
}

TEST_F(Drawings, ASectionBetweenTwoPartsCutsNothing) {
  const std::string gap =
      file("gap.csg", "cube(10); multmatrix([[1,0,0,20],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube(10);");
  for (const auto& [place, is_cut] :
       {std::pair<const char*, bool>{"x:15", false}, {"-x:15", false}, {"x:25", true}}) {
    const Ended ended =
        bsp2("draw " + gap + " -o " + at("g.dxf") + " --views front --scale 1:1 --section A=" + place);
    ASSERT_EQ(ended.code, 0) << ended.text;
    EXPECT_EQ(length_in(at("g.dxf"), "SECTION") > 0, is_cut) << place;
  }
}

TEST_F(Drawings, OfASnapshotAreThoseOfItsModel) {
  std::mt19937 random(7);
  const std::string solid = file("solid.csg", random_solid(random));
  ASSERT_EQ(bsp2("run " + solid + " --snapshot " + at("run.h5") + " --quiet").code, 0);
  const std::string options = " --section A=y:50 --title t --date 2020-02-02 -o ";
  ASSERT_EQ(bsp2("draw " + solid + options + at("a.svg")).code, 0);
  const Ended ended = bsp2("draw " + at("run.h5") + options + at("b.svg"));
  ASSERT_EQ(ended.code, 0) << ended.text;
  EXPECT_EQ(bytes_of(at("a.svg")), bytes_of(at("b.svg")));
}

TEST_F(Drawings, AreReadByOthers) {
  const bool has_ezdxf = samples::run_command("/usr/bin/python3 -c 'import ezdxf'").code == 0,
             has_pdftotext = samples::run_command("command -v pdftotext").code == 0;
  if (!has_ezdxf && !has_pdftotext) GTEST_SKIP() << "neither ezdxf nor pdftotext is installed";
  const std::string solid =
      file("solid.csg",
           "difference() { cube(size=[40, 20, 10]); multmatrix([[1,0,0,20],[0,1,0,10],[0,0,1,-1],[0,0,0,1]]) "
           "cylinder(h=20, r1=4, r2=4, $fn=48); }");
  const Ended ended = bsp2("draw " + solid + " -o " + at("x.dxf") + " -o " + at("x.pdf") +
                           " --section A=y:10 --title Lager --author \"Zoë Ångström\"");
  ASSERT_EQ(ended.code, 0) << ended.text;
  if (has_ezdxf) {
    const Ended read = samples::run_command(
        "/usr/bin/python3 -c \"import ezdxf; d = ezdxf.readfile('" + at("x.dxf") +
        "'); a = d.audit(); print(len(a.errors), len(a.fixes), sorted(set(e.dxf.layer for e in "
        "d.modelspace())), [t.plain_text() for t in d.modelspace().query('TEXT') if 'Z' in "
        "t.plain_text()])\"");
    EXPECT_EQ(read.text,
              "0 0 ['CENTER', 'DIMENSION', 'FRAME', 'HIDDEN', 'SECTION', 'VISIBLE'] ['Zoë Ångström']\n");
  }
  if (has_pdftotext) {
    const Ended read = samples::run_command("pdftotext " + at("x.pdf") + " -");
    for (const char* words : {"Lager", "Zoë Ångström", "A–A", "40", "First angle"})
      EXPECT_NE(read.text.find(words), std::string::npos) << words << " in " << read.text;
  }
}

}  // namespace
}  // namespace bsp2::models
