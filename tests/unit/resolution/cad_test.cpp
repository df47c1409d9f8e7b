// Files for CAD programs, read back by Open CASCADE: valid shapes, solids of the right volumes, names and
// colours.

#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <IGESControl_Reader.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <STEPControl_Reader.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Vertex.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
// gtest after Open CASCADE: both have macros
#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "bsp2/dataflow/surface/untouched.hpp"
#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/io/outputs/cad.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::dataflow {
namespace {
namespace fs = std::filesystem;

TopoDS_Shape read(const fs::path& path) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  if (path.extension() == ".brep") {
    TopoDS_Shape shape;
    EXPECT_TRUE(BRepTools::Read(shape, path.c_str(), BRep_Builder()));
    return shape;
  }
  const auto read_with = [&](auto&& reader) {
    EXPECT_EQ(reader.ReadFile(path.c_str()), IFSelect_RetDone);
    reader.TransferRoots();
    return reader.OneShape();
  };
  return path.extension() == ".iges" ? read_with(IGESControl_Reader()) : read_with(STEPControl_Reader());
}

/// The volumes of the solids in a file, in ascending order.
std::vector<double> volumes_in(const fs::path& path) {
  const TopoDS_Shape shape = read(path);
  EXPECT_TRUE(BRepCheck_Analyzer(shape).IsValid());
  std::vector<double> volumes;
  for (TopExp_Explorer solid(shape, TopAbs_SOLID); solid.More(); solid.Next()) {
    GProp_GProps properties;
    BRepGProp::VolumeProperties(solid.Current(), properties);
    volumes.push_back(properties.Mass());
  }
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

geometry::Brep brep_of(const model::Expression& e, double coincidence = 1e-9) {
  const Resolved r = resolved(e, {}, 0, coincidence);
  return geometry::brep_of(r.network.table, skin_of(r.network, r.batches, nullptr, true));
}

void expect_read_back(const geometry::Brep& brep, const std::vector<std::string>& names = {}) {
  const samples::TemporaryFolder folder;
  std::vector<double> volumes;
  for (const auto& solid : brep.solids) volumes.push_back(solid.volume);
  std::sort(volumes.begin(), volumes.end());
  for (const char* name : {"solid.step", "solid.iges", "solid.brep"}) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(io::write_cad(folder.path() / name, brep, {.names = names, .colours = {}}).empty());
    const auto found = volumes_in(folder.path() / name);
    ASSERT_EQ(found.size(), volumes.size());
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], volumes[i], 1e-9 * volumes[i]);
  }
}

model::Expression at(double x, double y, double z, double size) {
  return model::transform(std::vector<double>{size, 0, 0, x, 0, size, 0, y, 0, 0, size, z, 0, 0, 0, 1},
                          model::cuboid(std::vector<double>{1, 1, 1}));
}

TEST(Cad, HoldsHolesCavitiesAndSolidsThatTouch) {
  const auto frame = model::subtract(
      {at(0, 0, 0, 3), model::transform(std::vector<double>{1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 5, -1, 0, 0, 0, 1},
                                        model::cuboid(std::vector<double>{1, 1, 1}))});
  ASSERT_NO_FATAL_FAILURE(expect_read_back(brep_of(frame)));
  const auto hollow = model::subtract({at(0, 0, 0, 9), at(1, 1, 1, 3), at(5, 5, 5, 2)});
  ASSERT_NO_FATAL_FAILURE(expect_read_back(brep_of(hollow)));
  const auto touching = model::unite({at(0, 0, 0, 1), at(1, 1, 0, 1), at(2, 2, 1, 1)});
  ASSERT_NO_FATAL_FAILURE(expect_read_back(brep_of(touching)));
}

TEST(Cad, HoldsRandomSolids) {
  int rounds = 0;
  for (int round = 0; round < samples::rounds(40); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const geometry::Brep brep = brep_of(random_expression(random, 3, Kind::grid_boxes, 2));
    if (brep.solids.empty()) continue;
    ++rounds;
    ASSERT_NO_FATAL_FAILURE(expect_read_back(brep));
  }
  EXPECT_GT(rounds, 0);
}

/// The corners of the shapes in a file, each once, in ascending order.
std::vector<std::array<double, 3>> corners_in(const fs::path& path) {
  std::vector<std::array<double, 3>> corners;
  for (TopExp_Explorer vertex(read(path), TopAbs_VERTEX); vertex.More(); vertex.Next()) {
    const gp_Pnt p = BRep_Tool::Pnt(TopoDS::Vertex(vertex.Current()));
    corners.push_back({p.X(), p.Y(), p.Z()});
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

TEST(Cad, HoldsAllDigitsOfCorners) {
  for (int round = 0; round < samples::rounds(10); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto number = [&](double most) {
      return std::uniform_real_distribution<double>(1e-3, 1)(random) * most;
    };
    const double size = std::pow(10, static_cast<int>(random() % 9) - 3);
    const auto e =
        model::transform(std::vector<double>{number(size), number(size), 0, number(size), 0, number(size),
                                             number(size), -number(size), 0, 0, number(size), 0, 0, 0, 0, 1},
                         model::cuboid(std::vector<double>{1, 1, 1}));
    const geometry::Brep brep = brep_of(e);
    auto corners = brep.points;
    std::sort(corners.begin(), corners.end());
    const samples::TemporaryFolder folder;
    for (const char* name : {"solid.step", "solid.iges"}) {  // Open CASCADE gives .brep 15
      SCOPED_TRACE(name);
      ASSERT_TRUE(io::write_cad(folder.path() / name, brep, {}).empty());
      ASSERT_EQ(corners_in(folder.path() / name), corners);
    }
  }
}

/// Prisms upon each other, one wider by a hair: between them is a ring that no program can cut.
TEST(Cad, LeavesOutRingsThatAreLines) {
  for (const double wider : {1e-11, -1e-11, 1e-13}) {
    const auto upper = model::transform(std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1},
                                        model::cylinder(1, 3 + wider, 3 + wider, 12));
    const auto e = model::unite({model::cylinder(1, 3, 3, 12), upper});
    const geometry::Brep brep = brep_of(e, 0);
    ASSERT_GT(brep.faces.size(), 14U);
    ASSERT_NO_FATAL_FAILURE(expect_read_back(brep)) << wider;
  }
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Cad, FilesDoNotTellWhoWroteThem) {
  const geometry::Brep brep = brep_of(at(0, 0, 0, 1));
  const samples::TemporaryFolder folder;
  for (const char* name : {"a.step", "a.iges", "a.brep"}) {
    SCOPED_TRACE(name);
    const auto written = [&](const char* user) {
      ::setenv("USER", user, 1);
      ::setenv("LOGNAME", user, 1);
      EXPECT_TRUE(io::write_cad(folder.path() / name, brep, {}).empty());
      return std::regex_replace(text_of(folder.path() / name),
                                std::regex(R"(20\d{6}\.\d{6}|20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d)"), "DATE");
    };
    const std::string text = written("mallory");
    EXPECT_EQ(text, written("trudy"));
    EXPECT_EQ(text.find("mallory"), std::string::npos);
    if (const passwd* user = ::getpwuid(::getuid()); user != nullptr) {
      EXPECT_FALSE(std::regex_search(text, std::regex("\\b" + std::string(user->pw_name) + "\\b"))) << text;
    }
  }
}

/// Of each product, by its name: how many solids, and what colour.
struct Product {
  std::size_t solids = 0;
  std::array<int, 3> colour{};
};

std::map<std::string, Product> products_in(const fs::path& path) {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document);
  STEPCAFControl_Reader reader;
  reader.SetColorMode(true);
  reader.SetNameMode(true);
  EXPECT_EQ(reader.ReadFile(path.c_str()), IFSelect_RetDone);
  EXPECT_TRUE(reader.Transfer(document));
  TDF_LabelSequence labels;
  XCAFDoc_DocumentTool::ShapeTool(document->Main())->GetFreeShapes(labels);
  const auto colours = XCAFDoc_DocumentTool::ColorTool(document->Main());
  std::map<std::string, Product> products;
  for (const TDF_Label& label : labels) {
    Handle(TDataStd_Name) name;
    EXPECT_TRUE(label.FindAttribute(TDataStd_Name::GetID(), name));
    std::string text(static_cast<std::size_t>(name->Get().LengthOfCString()), '\0');
    char* at = text.data();
    name->Get().ToUTF8CString(at);
    Product& product = products[text];
    const TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(label);
    for (TopExp_Explorer solid(shape, TopAbs_SOLID); solid.More(); solid.Next()) ++product.solids;
    Quantity_Color colour;
    const bool is_coloured =
        colours->GetColor(shape, XCAFDoc_ColorSurf, colour) ||
        colours->GetColor(TopExp_Explorer(shape, TopAbs_SOLID).Current(), XCAFDoc_ColorSurf, colour);
    if (!is_coloured) continue;
    double red = 0, green = 0, blue = 0;
    colour.Values(red, green, blue, Quantity_TOC_sRGB);
    product.colour = {static_cast<int>(std::lround(255 * red)), static_cast<int>(std::lround(255 * green)),
                      static_cast<int>(std::lround(255 * blue))};
  }
  return products;
}

TEST(Cad, HoldsPartsByNameAndColour) {
  const auto e = model::unite({model::part("post", model::unite({at(0, 0, 0, 1), at(5, 0, 0, 1)})),
                               model::part("Schräge", at(1, 0, 0, 1))});
  const geometry::Brep brep = brep_of(e);
  const samples::TemporaryFolder folder;
  io::SurfaceParts parts{.names = {"post", "Schräge"}, .colours = {{{255, 0, 0, 255}}, {{0, 128, 255, 255}}}};
  ASSERT_TRUE(io::write_cad(folder.path() / "parts.step", brep, parts).empty());
  const auto products = products_in(folder.path() / "parts.step");
  ASSERT_EQ(products.size(), 2U);
  EXPECT_EQ(products.at("post").solids, 2U);
  EXPECT_EQ(products.at("Schräge").solids, 1U);
  EXPECT_EQ(products.at("post").colour, (std::array<int, 3>{255, 0, 0}));
  EXPECT_EQ(products.at("Schräge").colour, (std::array<int, 3>{0, 128, 255}));
  EXPECT_EQ(volumes_in(folder.path() / "parts.step").size(), 3U);
}

TEST(Cad, TellsOfEdgesThatCadProgramsTakeForPoints) {
  const auto thin = model::transform(std::vector<double>{1e-8, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                     at(0, 0, 0, 1));
  const samples::TemporaryFolder folder;
  const auto notes =
      io::write_cad(folder.path() / "thin.brep", brep_of(model::unite({thin, at(3, 0, 0, 1)})));
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[0].find("4 edges are shorter than 1e-7"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("1 solid is thinner than 1e-7, and left out"), std::string::npos) << notes[1];
  for (const char* name : {"all.step", "all.iges", "all.brep"}) {
    try {
      ADD_FAILURE() << name << ": " << io::write_cad(folder.path() / name, brep_of(thin)).size();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("all of it is thinner than 1e-7"), std::string::npos)
          << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(folder.path() / name));
  }
}

/// A turn by random angles, longer by `scale`, to a place.
model::Expression turned(std::mt19937& random, const std::array<double, 3>& to, double scale,
                         const model::Expression& e) {
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
  const double a = angle(random), b = angle(random), sa = scale * std::sin(a), ca = scale * std::cos(a);
  return model::transform(std::vector<double>{ca, -sa * std::cos(b), sa * std::sin(b), to[0], sa,
                                              ca * std::cos(b), -ca * std::sin(b), to[1], 0,
                                              scale * std::sin(b), scale * std::cos(b), to[2], 0, 0, 0, 1},
                          e);
}

struct Round {
  model::Expression solid;
  double volume;
};

/// Of a size below 6.
Round random_round(std::mt19937& random) {
  std::uniform_real_distribution<double> size(0.5, 2);
  const double r = size(random), h = size(random), other = r * (size(random) - 0.5) / 1.6;
  switch (random() % 4) {
    case 0:
      return {model::ball(3, r), 4 * std::numbers::pi / 3 * r * r * r};
    case 1:
      return {model::round_cylinder(2, r, {h}), std::numbers::pi * r * r * h};
    case 2:
      return {model::cone(h, other, r), std::numbers::pi / 3 * h * (r * r + r * other + other * other)};
    default:
      return {model::torus(r, 0.3 * r), 2 * std::numbers::pi * std::numbers::pi * r * 0.09 * r * r};
  }
}

/// By formulas, however coarse its cells are; beside it are a cube, and round solids that are not as they
/// were: a ball that is cut, one that is stretched and one that something touches keep the faces of their
/// cells.
TEST(Cad, WhatIsRoundAndUntouchedHasItsTrueSurface) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(2); ++round) {
    const double scale = 0.25 * (1 + static_cast<double>(random() % 8));
    const auto [solid, volume] = random_round(random);
    const auto again = random_round(random);
    const auto stretched = model::transform(
        std::vector<double>{1, 0, 0, -20, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, model::ball(3, 1));
    const auto moved = [](double x, double y, const model::Expression& e) {
      return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, 0, 0, 0, 0, 1}, e);
    };
    const auto e = model::unite({turned(random, {20, 0, 0}, scale, solid),
                                 turned(random, {0, 20, 0}, 1, again.solid), at(-3, -3, 0, 1), stretched,
                                 moved(0, -20, model::subtract({model::ball(3, 1), at(0, 0, 0, 2)})),
                                 moved(-20, -20, model::unite({model::ball(3, 1), at(0, 0, 0, 2)}))});
    const Resolved r = resolved(e, {.tolerance = 0.4});
    const auto brep = geometry::brep_of(r.network.table, skin_of(r.network, r.batches, nullptr, true));
    const auto rounds = untouched_rounds(r.network);
    ASSERT_EQ(rounds.size(), 2U);
    std::vector<double> expected{volume * scale * scale * scale, again.volume};
    for (const auto& other : brep.solids) {
      const auto& p = brep.points[brep.from(brep.uses_of(
          brep.loops_of(brep.faces[brep.sides_of(brep.shells[other.first_shell])[0].face])[0])[0])];
      if (p[0] < 10 && p[1] < 10) expected.push_back(other.volume);
    }
    std::sort(expected.begin(), expected.end());
    const samples::TemporaryFolder folder;
    for (const char* name : {"solid.step", "solid.iges", "solid.brep"}) {
      SCOPED_TRACE(name);
      const auto notes = io::write_cad(folder.path() / name, brep, {}, rounds);
      ASSERT_FALSE(notes.empty());
      EXPECT_NE(notes.back().find(": 2 round solids that touch nothing else have their true surfaces"),
                std::string::npos);
      const auto found = volumes_in(folder.path() / name);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-9 * expected[i]);
    }
  }
}

/// What is said of them, and what no program can hold.
TEST(Cad, RoundSolidsAreThereWithoutCellsUnlessTheyAreTooSmall) {
  const samples::TemporaryFolder folder;
  const auto rounds_of = [](const model::Expression& e) { return untouched_rounds(compile<3>(e, {})); };
  const auto notes = io::write_cad(folder.path() / "ball.step", {}, {}, rounds_of(model::ball(3, 2)));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find(": 1 round solid that touches nothing else has its true surface, not that"),
            std::string::npos);
  ASSERT_EQ(volumes_in(folder.path() / "ball.step").size(), 1U);
  EXPECT_NEAR(volumes_in(folder.path() / "ball.step")[0], 32 * std::numbers::pi / 3, 1e-9);
  EXPECT_TRUE(rounds_of(model::torus(1, 1)).empty()) << "it touches itself";
  EXPECT_TRUE(rounds_of(model::unite({model::ball(3, 1), model::ball(3, 2)})).empty());
  EXPECT_TRUE(rounds_of(model::intersect({model::ball(3, 1), at(-2, -2, -2, 4)})).empty());
  EXPECT_EQ(rounds_of(model::unite({model::ball(3, 1), at(1.5, 0, 0, 1)})).size(), 1U);
}

}  // namespace
}  // namespace bsp2::dataflow
