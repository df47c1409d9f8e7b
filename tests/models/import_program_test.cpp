// What the program writes for other programs it reads again, as a model: the same solids, parts and colours.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include "support/command.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;

using samples::Ended;

Ended run(const std::string& arguments) { return samples::run_command(BSP2_PROGRAM " " + arguments); }

/// Parts that stand free of each other, each a solid with bites out of it.
std::string random_model(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  std::ostringstream text;
  const auto solid = [&](int from, int size) {
    text << "multmatrix([[1,0,0," << from + pick(0, 3) << "],[0,1,0," << pick(0, 3) << "],[0,0,1,"
         << pick(0, 3) << "],[0,0,0,1]]) ";
    if (pick(0, 1) == 0)
      text << "cube([" << size + pick(0, 3) << "," << size + pick(0, 3) << "," << size + pick(0, 3)
           << "]);\n";
    else
      text << "cylinder(h = " << size + pick(0, 3) << ", r = " << size << ", $fn = " << pick(3, 9) << ");\n";
  };
  const int parts = pick(1, 4);
  for (int i = 0; i < parts; ++i) {
    text << "part(name = \"part " << static_cast<char>('a' + i) << "\") ";
    if (i % 2 == 0) text << "color([" << (pick(0, 1) == 0 ? "1" : "0.2") << ",0,0,1]) ";
    text << "difference() {\n";
    solid(40 * i, 6);
    for (int k = pick(0, 2); k > 0; --k) solid(40 * i + 3, 2);
    text << "}\n";
  }
  return text.str();
}

class ReadAgain : public testing::Test {
 protected:
  samples::TemporaryFolder folder_;

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  nlohmann::json report_of(const std::string& model, const std::string& more = "") {
    const std::string report = path("report.json");
    fs::remove(report);
    const Ended ended = run("run " + model + " --quiet --threads 1 --report " + report + " " + more);
    EXPECT_EQ(ended.code, 0) << ended.text;
    std::ifstream file(report);
    return nlohmann::json::parse(file, nullptr, false);
  }
};

TEST_F(ReadAgain, RandomPartsInAllFormats) {
  const std::map<std::string, std::pair<double, bool>> formats{
      {".step", {1e-9, true}}, {".iges", {1e-9, true}}, {".3mf", {1e-5, true}},  {".glb", {1e-5, true}},
      {".gltf", {1e-5, true}}, {".vtp", {1e-9, true}},  {".brep", {1e-9, false}}};
  for (int round = 0; round < samples::rounds(2); ++round) {
    const std::uint64_t seed = samples::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    std::ofstream(path("model.csg")) << random_model(seed);
    std::string outputs;
    for (const auto& [ending, promise] : formats) outputs += " --boundary " + path("out" + ending);
    const nlohmann::json wanted = report_of(path("model.csg"), outputs);
    for (const auto& [ending, promise] : formats) {
      SCOPED_TRACE(ending);
      const auto& [precision, has_names] = promise;
      const nlohmann::json found = report_of(path("out" + ending), "--boundary " + path("again.stl"));
      ASSERT_EQ(found.at("boundary").at("closed"), true);
      const double volume = wanted.at("volume").at("in");
      ASSERT_NEAR(found.at("volume").at("in").get<double>(), volume, precision * volume);
      if (!has_names) continue;
      ASSERT_EQ(found.at("parts").size(), wanted.at("parts").size());
      for (std::size_t i = 0; i < wanted.at("parts").size(); ++i) {
        const nlohmann::json &a = wanted.at("parts")[i], &b = found.at("parts")[i];
        ASSERT_EQ(a.at("name"), b.at("name"));
        const std::string colour = a.value("color", "");
        if (!colour.empty()) {
          ASSERT_EQ(b.value("color", ""), colour);
        }
        ASSERT_NEAR(b.at("volume").get<double>(), a.at("volume").get<double>(), precision * volume);
      }
    }
  }
}

/// Parts that touch and overlap, some more than once.
std::string touching_parts(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  std::ostringstream text;
  const int parts = pick(2, 5);
  for (int i = 0; i < parts; ++i) {
    text << "part(name = \"part " << i << "\") color([" << 0.25 * (i % 4 + 1) << ", 0, 0, 1])";
    if (pick(0, 1) == 0) {
      text << " cube([" << pick(1, 6) << ", " << pick(1, 6) << ", " << pick(1, 6) << "]);\n";
      continue;
    }
    text << " multmatrix([[1, 0, 0, " << pick(0, 4) << "], [0, 1, 0, " << pick(0, 4) << "], [0, 0, 1, "
         << pick(0, 4) << "], [0, 0, 0, 1]]) ";
    if (pick(0, 1) == 0)
      text << "sphere(r = " << pick(1, 4) << ", $fn = " << pick(4, 12) << ");\n";
    else
      text << "cylinder(h = " << pick(1, 5) << ", r = " << pick(1, 4) << ", $fn = " << pick(3, 12) << ");\n";
  }
  return text.str();
}

/// Each is closed by itself.
TEST_F(ReadAgain, PartsThatTouchAreObjectsOfTheirOwn) {
  for (int round = 0; round < samples::rounds(8); ++round) {
    const std::uint64_t seed = samples::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    std::ofstream(path("model.csg")) << touching_parts(seed);
    const std::string file = path("out.3mf");
    const nlohmann::json wanted =
        report_of(path("model.csg"), "--boundary " + file + " --boundary " + path("out.amf"));
    const nlohmann::json found = report_of(file), whole = report_of(path("out.amf"));
    const double volume = wanted.at("volume").at("in");
    EXPECT_NEAR(whole.at("volume").at("in").get<double>(), volume, 1e-5 * volume);
    EXPECT_NEAR(found.at("volume").at("in").get<double>(), volume, 1e-5 * volume);
    std::map<std::string, std::pair<double, std::string>> parts, again;
    for (const auto& part : wanted.at("parts"))
      if (part.at("volume") > 0.0) parts[part.at("name")] = {part.at("volume"), part.value("color", "")};
    for (const auto& part : found.at("parts"))
      again[part.at("name")] = {part.at("volume"), part.value("color", "")};
    ASSERT_EQ(parts.size(), again.size());
    for (const auto& [name, part] : parts) {
      ASSERT_TRUE(again.contains(name)) << name;
      EXPECT_NEAR(again[name].first, part.first, 1e-5 * volume) << name;
      EXPECT_EQ(again[name].second, part.second) << name;
    }
  }
}

/// What is too small for the digits of a file, or for --clean, is told by name, also where it touches another
/// part.
TEST_F(ReadAgain, PartsOfWhichNothingIsLeftAreNamed) {
  std::ofstream(path("model.csg"))
      << "part(name = \"base\") cube([10000, 10000, 10000]);\npart(name = \"tiny\") multmatrix([[1, 0, 0, "
         "5000], [0, 1, 0, 5000], [0, 0, 1, 10000], [0, 0, 0, 1]]) cube([0.0001, 0.0001, 0.0001]);\n"
         "part(name = \"small\") multmatrix([[1, 0, 0, 7000], [0, 1, 0, 5000], [0, 0, 1, 10000], [0, 0, 0, "
         "1]]) cube([0.015, 0.017, 0.013]);\n";
  for (const std::string clean : {"", " --clean 0", " --clean 0.001"}) {
    SCOPED_TRACE(clean);
    const Ended ended = run("run " + path("model.csg") + " --boundary " + path("out.3mf") + clean);
    EXPECT_EQ(ended.code, 0);
    EXPECT_NE(ended.text.find("part 'tiny'"), std::string::npos) << ended.text;
    EXPECT_NE(ended.text.find("the single precision of .3mf changes"), std::string::npos) << ended.text;
    const nlohmann::json found = report_of(path("out.3mf"));
    std::set<std::string> names;
    for (const auto& part : found.at("parts")) names.insert(part.at("name"));
    EXPECT_EQ(names, (std::set<std::string>{"base", "small"}));
  }
  const Ended all = run("run " + path("model.csg") + " --clean 20000 --boundary " + path("none.3mf"));
  EXPECT_NE(all.text.find("nothing is left of 3 parts 'base', 'tiny' and 'small'"), std::string::npos)
      << all.text;
  const Ended nothing = run("run " + path("model.csg") + " --clean 0.1 --boundary " + path("out.step"));
  EXPECT_EQ(nothing.code, 2);
  EXPECT_NE(nothing.text.find("--clean: there are no triangles to clean"), std::string::npos) << nothing.text;
}

/// Also where it touches a part, so that both are one where only a surface is kept: it does not take the
/// part's name.
TEST_F(ReadAgain, WhatBelongsToNoPartIsCalledThat) {
  for (const int apart : {0, 1}) {
    std::ofstream(path("model.csg")) << "part(name = \"lid\") cube([1, 1, 1]);\nmultmatrix([[1, 0, 0, "
                                     << 1 + apart
                                     << "], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) cube([1, 1, 1]);\n";
    for (const std::string ending : {".3mf", ".glb", ".vtp", ".step"}) {
      SCOPED_TRACE(ending);
      report_of(path("model.csg"), "--boundary " + path("out" + ending));
      std::set<std::string> names;
      const nlohmann::json found = report_of(path("out" + ending));
      for (const auto& part : found.at("parts")) names.insert(part.at("name"));
      const bool are_one = apart == 0 && (ending == ".glb" || ending == ".vtp");
      const std::set<std::string> both = {"lid", "no_part"};
      EXPECT_TRUE(are_one ? names.size() == 1 &&
                                (names.contains("lid + no_part") || names.contains("no_part + lid"))
                          : names == both)
          << testing::PrintToString(names);
    }
  }
}

/// What is damaged is one message with the name of the file, and code 2.
TEST_F(ReadAgain, DamagedFilesAreOneMessage) {
  std::ofstream(path("model.csg")) << random_model(samples::new_seed());
  std::string outputs;
  const std::array<const char*, 7> endings{".step", ".iges", ".brep", ".3mf", ".glb", ".gltf", ".vtp"};
  for (const char* ending : endings) outputs += " --boundary " + path(std::string("out") + ending);
  ASSERT_EQ(run("run " + path("model.csg") + " --quiet" + outputs).code, 0);
  for (const char* ending : endings) {
    SCOPED_TRACE(ending);
    const std::string file = path(std::string("out") + ending);
    const auto size = fs::file_size(file);
    for (const std::uintmax_t part : {size / 2, size / 10, std::uintmax_t{1}}) {
      fs::resize_file(file, part);
      const Ended ended = run("run " + file + " --quiet");
      ASSERT_EQ(ended.code, 2) << ended.text;
      ASSERT_EQ(ended.text.find("bsp2: " + file), 0U) << ended.text;
      ASSERT_EQ(ended.text.find('\n'), ended.text.size() - 1) << ended.text;
    }
  }
}

/// VTK by itself finds no polygons in any of these, and says no more.
TEST_F(ReadAgain, SurfacesOfVtkTellWhyTheyAreNotRead) {
  const std::string file = path("x.vtp");
  const auto said = [&](const std::string& bytes) {
    std::ofstream(file) << bytes;
    const Ended ended = run("run " + file + " --quiet");
    EXPECT_EQ(ended.code, 2) << ended.text;
    return ended.text;
  };
  EXPECT_NE(said("solid x").find("is no XML file of VTK"), std::string::npos);
  EXPECT_NE(said("<VTKFile type=\"PolyData\">").find("cut off"), std::string::npos);
  EXPECT_NE(said("<VTKFile type=\"PolyData\"><PolyData></PolyData></VTKFile>").find("no polygons"),
            std::string::npos);
}

}  // namespace
}  // namespace bsp2::models
