#include "program/program.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "answers/progress_bar.hpp"
#include "answers/summary.hpp"
#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/report/report_json.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "support/sample_mesh.hpp"
#include "support/temporary_folder.hpp"
#include "tables/node_tables.hpp"

namespace bsp2::jobs {
namespace {

namespace fs = std::filesystem;
using api::to_json;
using supersteps::RunOptions;
using supersteps::RunResult;

supersteps::RunReport sample_report() {
  supersteps::RunReport report;
  report.model = "tower.csg";
  report.primitives = 2609;
  report.hyperplanes = 61234;
  report.in_cells = 123456789;
  report.in_volume = 0.1 + 0.2;
  report.centroid = {1.0 / 3, -2, 0};
  report.inertia = std::vector<std::vector<double>>(4, std::vector<double>(4, 1.5));
  report.lower = {-1e9, 0, 0};
  report.upper = {1.0 / 7, 1, 1};
  report.digest = "00ff";
  report.supersteps = {
      {"computation", 3, {0.5, 0.25}, {0.4, 0.2}, {0.125, 0}, {1, 2}, {3, 4}, {5, 6}, {1, 0}, 0.75}};
  report.predicates = 1000;
  report.exact_fallbacks = 5;
  report.seconds = 2;
  report.warnings = {"odd"};
  return report;
}

RunResult sample_result(const RunOptions& options, supersteps::Ranks&) {
  std::mt19937 random(1);
  RunResult result;
  result.report = sample_report();
  if (!options.collect_cells) return result;
  auto sample = samples::random_mesh(random, 30);
  result.mesh = {3, sample.batches};
  result.tree = sample.tree;
  if (options.boundary) {
    result.boundary = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                       {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}},
                       {0, 0, 0, 0}};
    result.report.boundary = {4, 2.366, true};
  }
  return result;
}

TEST(ReportJson, HasTheKeysOfTheDesignAndExactNumbers) {
  auto report = sample_report();
  const auto json = nlohmann::ordered_json::parse(to_json(report));
  std::vector<std::string> keys;
  for (const auto& item : json.items()) keys.push_back(item.key());
  EXPECT_EQ(keys,
            (std::vector<std::string>{"model",          "dimension", "ranks",      "threads",
                                      "regions",        "level",     "primitives", "hyperplanes",
                                      "cells",          "volume",    "centroid",   "inertia",
                                      "bounds",         "boundary",  "digest",     "surface_digest",
                                      "supersteps",     "stats",     "seconds",    "cpu_seconds",
                                      "peak_rss_bytes", "warnings",  "notes",      "overlapping_meshes"}));
  EXPECT_EQ(json["volume"]["in"].get<double>(), 0.1 + 0.2);
  EXPECT_EQ(json["centroid"][0].get<double>(), 1.0 / 3);
  EXPECT_EQ(json["bounds"][1][0].get<double>(), 1.0 / 7);
  EXPECT_EQ(json["cells"]["in"], 123456789);
  EXPECT_TRUE(json["cells"]["out"].is_null());
  EXPECT_TRUE(json["boundary"].is_null());
  EXPECT_EQ(json["supersteps"][0]["bytes_received"][1], 4);
  report.out_cells = 7;
  report.boundary = {12, 6.5, true};
  report.lower.clear();
  report.centroid.clear();
  report.model = "\xff.csg";  // no UTF-8
  const auto other = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(other["cells"]["out"], 7);
  EXPECT_EQ(other["boundary"].dump(), R"({"area":6.5,"closed":true,"triangles":12})");
  EXPECT_TRUE(other["bounds"].is_null());
  EXPECT_EQ(other["overlapping_meshes"].dump(), "[]");
}

/// "cells.in" of {"cells": {"in": 1}}, "parts[].name" of {"parts": [{"name": ""}]}.
void add_paths(const nlohmann::json& json, const std::string& path, std::set<std::string>& paths) {
  if (json.is_array())
    for (const auto& item : json) add_paths(item, path + "[]", paths);
  if (!json.is_object()) return;
  for (const auto& item : json.items()) {
    const std::string name = (path.empty() ? "" : path + ".") + item.key();
    paths.insert(name);
    add_paths(item.value(), name, paths);
  }
}

/// The names in backticks in the first column of the page's table.
std::set<std::string> documented_fields() {
  std::ifstream page(BSP2_SOURCE_DIR "/docs/report.md");
  std::set<std::string> fields;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string column = line.substr(0, line.find(" | "));
    for (std::size_t from = column.find('`'), to = 0; from != std::string::npos;
         from = column.find('`', to + 1)) {
      to = column.find('`', from + 1);
      EXPECT_TRUE(fields.insert(column.substr(from + 1, to - from - 1)).second) << line;
    }
  }
  return fields;
}

TEST(ReportJson, IsDocumentedFieldByField) {
  auto report = sample_report();
  report.tolerance = report.angle = 0.5;
  report.eye = {1, 2, 3};
  report.inertia_least = report.inertia_most = report.inertia;
  report.named_parts = {{0, "knob", supersteps::Rgba{255, 0, 0, 128}, 0.5}};
  report.measures = {{report, "all", 3}};
  report.boundary = {12, 6.5, true};
  report.boundary->cleaned = {{"a.stl", 0.1}};
  report.simplices = {28990, 0.5, 3, 1e-17};
  report.notes = {"from within"};
  report.failed = {{"cannot write"}};
  report.overlapping_meshes = {{"a.csg:3:1", "", 2, 8160, 1 / 3.0}};
  std::set<std::string> written;
  const MeshFigures mesh;
  add_paths(nlohmann::json::parse(to_json(report, &mesh)), "", written);
  EXPECT_EQ(documented_fields(), written);
}

TEST(ReportJson, ListsPartsWithColourAndVolume) {
  auto report = sample_report();
  report.named_parts = {{0, "knob", supersteps::Rgba{255, 0, 16, 128}, 0.5},
                        {1, "red", supersteps::Rgba{255, 0, 0, 255}, 2},
                        {2, "rest", {}, 0}};
  const auto json = nlohmann::json::parse(to_json(report))["parts"];
  EXPECT_EQ(json.dump(), R"([{"color":"#ff001080","name":"knob","part":0,"volume":0.5},)"
                         R"({"color":"#ff0000","name":"red","part":1,"volume":2.0},)"
                         R"({"name":"rest","part":2,"volume":0.0}])");
}

TEST(ReportJson, ListsOverlappingMeshes) {
  auto report = sample_report();
  report.overlapping_meshes = {{"a.csg:3:1", "", 2, 8160, 1 / 3.0}, {"a.csg:4:1", "b.stl", 3, 12, {}}};
  const auto json = nlohmann::json::parse(to_json(report))["overlapping_meshes"];
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0]["volume_by_faces"].get<double>(), 1 / 3.0);
  EXPECT_EQ(json[0]["file"], nullptr);
  EXPECT_EQ(json[1].dump(),
            R"({"file":"b.stl","place":"a.csg:4:1","primitive":3,"triangles":12,"volume_by_faces":null})");
}

TEST(Summary, FitsATerminalAndGroupsDigits) {
  std::ostringstream out;
  auto report = sample_report();
  report.simplices = {28990, 0.5, 123456, 1.23e-17};
  const Figures figures = api::figures_in(report);
  print_summary(out, figures, true);
  print_stats(out, figures);
  EXPECT_NE(out.str().find("123,456,789 cells"), std::string::npos);
  EXPECT_NE(out.str().find("communicated 0.125 s while workers computed, and waited 0.150 s"),
            std::string::npos)
      << out.str();
  EXPECT_NE(out.str().find("of all h, 4 B, 25 % was hidden behind their work"), std::string::npos)
      << out.str();
  EXPECT_NE(out.str().find("(0.5000 % of the predicates)"), std::string::npos);
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

TEST(Tables, FitATerminalAndAddUp) {
  std::vector<ClusterTable> measured;
  for (const auto level : {std::optional(12U), std::optional(100U), std::optional<unsigned>()}) {
    ClusterTable resolved{level, 128, {}, {1.5, 1, 0.5, 0.25, 0.125}};
    for (const std::size_t nodes : {1U, 2U, 4U, 8U, 16U})
      resolved.nodes.emplace_back(nodes, NodeFigures{123456, 65432, 1000, 5000000, 12.5});
    resolved.nodes.back().back().splits = 4000;
    measured.push_back(resolved);
  }
  std::ostringstream out;
  print_tables(out, measured);
  EXPECT_NE(out.str().find("Table 6: model resolution and run times, number of nodes n = 16"),
            std::string::npos);
  EXPECT_NE(out.str().find("246,912"), std::string::npos);  // of two nodes
  // The last node of 16 makes four times as many splits as the others.
  EXPECT_NE(out.str().find("10^3 splits        1.0       2.0       4.0       8.0      19.0\n"
                           "  max/mean         1.000     1.000     1.000     1.000     3.368"),
            std::string::npos)
      << out.str();
  EXPECT_NE(out.str().find("efficiency       1.000     0.500     0.250     0.125     0.062"),
            std::string::npos)
      << out.str();
  EXPECT_NE(out.str().find("distribution    1.5000    1.0000    0.5000    0.2500    0.1250"),
            std::string::npos)
      << out.str();
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

TEST(Tables, LeaveSpaceBetweenLargeNumbersAndEndEarlyIfBrief) {
  ClusterTable resolved{{}, 8192, {}, {1, 1}};
  for (const std::size_t nodes : {2U, 1024U})
    resolved.nodes.emplace_back(nodes, NodeFigures{1, 0, 8'000'000'000, 90'000'000'000, 700.5});
  std::ostringstream out;
  print_tables(out, {resolved}, true);
  EXPECT_NE(out.str().find(" 1401.0000 717312.0000"), std::string::npos) << out.str();  // the sums
  EXPECT_EQ(out.str().find("efficiency"), std::string::npos) << out.str();  // of one node is nothing known
  EXPECT_EQ(out.str().find("Table 2"), std::string::npos) << out.str();
}

/// 30 s of one node are 0.47 s of each of 64; the slowest ones take 0.6 s, and the list 0.1 s.
TEST(Tables, TellHowWellNodesShareTheSurface) {
  std::ostringstream out;
  print_surface_table(out, {{1, 20, 20, 10, 10, 0, 1234567}, {64, 0.3, 0.375, 0.15, 0.225, 0.1, 1234567}});
  EXPECT_NE(out.str().find("1,234,567 triangles"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("efficiency             1.000     0.781"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("with the list          1.000     0.670"), std::string::npos) << out.str();
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

using Run = std::function<RunResult(const RunOptions&, supersteps::Ranks&)>;

/// The program by one process.
int start(const std::vector<std::string>& arguments, std::ostream& out, const Run& run) {
  return program(arguments, out, Ranks(std::make_shared<Ranks::Implementation>(supersteps::Ranks(), run)));
}

TEST(Program, WritesWhatTheFolderNames) {
  const samples::TemporaryFolder folder;
  const fs::path dir = folder.path() / "a" / "b";
  std::ostringstream out;
  EXPECT_EQ(start({"run", "x", "-o", dir.string()}, out, sample_result), 0);
  for (const char* name : {"report.json", "solid.pvtu", "solid_0.vtu", "view.png", "boundary.stl"})
    EXPECT_TRUE(fs::exists(dir / name)) << name;
  EXPECT_EQ(std::distance(fs::directory_iterator(dir), fs::directory_iterator()), 5);
  std::ifstream report(dir / "report.json");
  const auto supersteps = nlohmann::json::parse(report)["supersteps"];
  EXPECT_EQ(supersteps.at(supersteps.size() - 2)["name"], "rendering");
  EXPECT_EQ(supersteps.back()["name"], "writing");
  EXPECT_NE(out.str().find("tower.csg"), std::string::npos);
}

/// A surface has the colours of parts: where those of the model are lost, a file that could hold them tells.
TEST(Program, ColoursThatASurfaceLosesAreTold) {
  const samples::TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  const auto notes = [&](bool with_parts, const std::vector<std::string>& files) {
    const auto run = [&](const RunOptions& options, supersteps::Ranks& ranks) {
      RunResult result = sample_result(options, ranks);
      result.colour_of_primitive = {supersteps::Rgba{255, 0, 0, 255}, std::nullopt};
      if (with_parts) {
        result.part_names = {"red"};
        result.report.named_parts = {{0, "red", supersteps::Rgba{255, 0, 0, 255}}};
      }
      return result;
    };
    std::vector<std::string> arguments{"run", "x", "--report", path("r.json")};
    for (const std::string& file : files) arguments.insert(arguments.end(), {"--boundary", file});
    std::ostringstream out;
    EXPECT_EQ(start(arguments, out, run), 0);
    for (const std::string& file : files) {
      EXPECT_TRUE(fs::exists(file)) << file;
      EXPECT_NE(out.str().find(file), std::string::npos) << file;
    }
    std::ifstream report(path("r.json"));
    return nlohmann::json::parse(report)["notes"].size();
  };
  EXPECT_EQ(notes(false, {path("a.stl")}), 0U);
  EXPECT_EQ(notes(false, {path("a.stl"), path("a.3mf"), path("a.glb")}), 1U);
  EXPECT_EQ(notes(true, {path("b.3mf"), path("b.obj")}), 0U);
  EXPECT_TRUE(fs::exists(path("b.mtl")));
  EXPECT_FALSE(fs::exists(path("a.mtl")));
}

TEST(Program, FourDimensionsGiveAReportOnly) {
  const samples::TemporaryFolder folder;
  const auto run = [](const RunOptions&, supersteps::Ranks&) {
    RunResult result;
    result.report.dimension = result.mesh.dimension = 4;
    return result;
  };
  std::ostringstream out;
  EXPECT_EQ(start({"run", "x", "-o", folder.path().string() + "/"}, out, run), 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
  EXPECT_EQ(start({"run", "x", "--picture", (folder.path() / "p.png").string()}, out, run), 2);
  EXPECT_EQ(start({"run", "x", "--boundary", (folder.path() / "b.stl").string()}, out, run), 2);
}

/// What is computed is written, each output by itself.
TEST(Program, AnOutputThatFailsTakesNothingElseAlong) {
  const samples::TemporaryFolder folder;
  std::ostringstream out;
  for (const std::string failing : {"solid.pvtu", "boundary.stl", "view.png", "report.json"}) {
    SCOPED_TRACE(failing);
    const fs::path dir = folder.path() / (failing + ".d");
    const auto run = [&](const RunOptions& options, supersteps::Ranks& ranks) {
      fs::create_directories(dir / failing / "in the way");  // while it computes
      return sample_result(options, ranks);
    };
    EXPECT_EQ(start({"run", "x", "-o", dir.string()}, out, run), 2);
    for (const char* name : {"report.json", "solid.pvtu", "view.png", "boundary.stl"})
      EXPECT_EQ(fs::is_regular_file(dir / name), name != failing) << name;
    if (failing == "report.json") continue;
    std::ifstream report(dir / "report.json");
    const auto failed = nlohmann::json::parse(report)["failed"];
    ASSERT_EQ(failed.size(), 1U);
    EXPECT_NE(failed[0].get<std::string>().find((dir / failing).string()), std::string::npos) << failed[0];
  }
}

TEST(Program, AnErrorOfOursInOneOutputIsToldWithTheOthersWritten) {
  const samples::TemporaryFolder folder;
  const fs::path dir = folder.path() / "out";
  const auto run = [](const RunOptions& options, supersteps::Ranks& ranks) {
    RunResult result = sample_result(options, ranks);
    result.boundary.reset();
    result.report.boundary.reset();
    result.report.failed.push_back({"the boundary: internal error: a bug"});
    return result;
  };
  fs::create_directories(dir);
  std::ofstream(dir / "boundary.stl") << "of an earlier run";
  std::ostringstream out;
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(start({"run", "x", "-o", dir.string()}, out, run), 1);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "bsp2: warning: odd\nbsp2: the boundary: internal error: a bug\n");
  EXPECT_FALSE(fs::exists(dir / "boundary.stl")) << "it would pass for this run's";
  for (const char* name : {"report.json", "solid.pvtu", "view.png"})
    EXPECT_TRUE(fs::exists(dir / name)) << name;
  EXPECT_EQ(out.str().find("boundary.stl"), std::string::npos) << out.str();
}

TEST(Program, TetrahedraAreToldOf) {
  const samples::TemporaryFolder folder;
  const fs::path dir = folder.path() / "out";
  std::ostringstream out;
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(start({"run", "x", "--tets", "-o", dir.string()}, out, sample_result), 0);
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("do not meet face to face"), std::string::npos);
  EXPECT_NE(out.str().find("smallest dihedral angle"), std::string::npos) << out.str();
  std::ifstream file(dir / "report.json");
  const auto report = nlohmann::json::parse(file);
  EXPECT_GT(report["simplices"]["count"], 30);
  EXPECT_GT(report["simplices"]["smallest_angle"], 0);
  EXPECT_LT(report["simplices"]["smallest_angle"], 70.6);  // of a regular one
  EXPECT_EQ(report["notes"].size(), 1U);
}

TEST(Program, ExitCodesTellWhoseMistakeItIs) {
  const samples::TemporaryFolder folder;
  const std::string file = (folder.path() / "file").string();
  std::ofstream(file) << "x";
  std::ostringstream out;
  bool has_run = false;
  const auto spy = [&](const RunOptions& options, supersteps::Ranks& ranks) {
    return has_run = true, sample_result(options, ranks);
  };
  EXPECT_EQ(start({"run", "x", "--nonsense"}, out, spy), 2);
  EXPECT_EQ(start({"run", "x", "-o", file}, out, spy), 2);
  EXPECT_EQ(start({"run", "x", "--report", folder.path().string()}, out, spy), 2);
  EXPECT_FALSE(has_run) << "bad outputs are noticed before the work";
  EXPECT_EQ(start({"run", "x"}, out,
                  [](const RunOptions&, supersteps::Ranks&) -> RunResult { throw Error("bad model"); }),
            2);
  EXPECT_EQ(start({"run", "x"}, out,
                  [](const RunOptions&, supersteps::Ranks&) -> RunResult { throw std::logic_error("bug"); }),
            1);
  EXPECT_EQ(start({"run", "x"}, out,
                  [](const RunOptions&, supersteps::Ranks&) -> RunResult { throw std::bad_alloc(); }),
            1);
  EXPECT_EQ(out.str(), "");
  EXPECT_EQ(start({"run", "x", "--quiet"}, out, spy), 0);
  EXPECT_EQ(out.str(), "");
}

TEST(ProgressBar, FitsItsTerminal) {
  const ProgressState state{
      .what = "computation", .share = 0.434, .cells = 123456, .seconds = 75, .seconds_of_this = 30};
  EXPECT_EQ(progress_line(state, 120),
            "computation  [#############.................]   43 %  1:15  123,456 cells  about 0:39 left");
  EXPECT_EQ(progress_line(state, 80),
            "computation  [#######..........]   43 %  1:15  123,456 cells  about 0:39 left");
  EXPECT_EQ(progress_line(state, 42), "computation   43 %  1:15  123,456 cells");
  EXPECT_EQ(progress_line(state, 41), "computation  [####......]   43 %  1:15");
  EXPECT_EQ(progress_line(state, 24), "computation   43 %");
  for (std::size_t columns = 1; columns < 200; ++columns)
    EXPECT_LE(progress_line(state, columns).size() + 3, std::max<std::size_t>(columns, 4)) << columns;
}

TEST(ProgressBar, TellsWhatIsKnown) {
  EXPECT_EQ(progress_line({.what = "writing solid.pvtu", .seconds = 3725}, 80),
            "writing solid.pvtu  1:02:05");
  EXPECT_EQ(progress_line({.what = "resolution", .share = 1.5, .cells = 1, .seconds = 0.9}, 50),
            "resolution  [############]  100 %  0:00  1 cell");
  // Too early for an estimate.
  EXPECT_EQ(progress_line({.what = "computation", .share = 0.5, .seconds_of_this = 0.5}, 120).find("left"),
            std::string::npos);
}

TEST(ProgressBar, IsForTerminals) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* file = open_memstream(&text, &size);
  {
    ProgressBar bar(file), none(nullptr);
    bar.begin("computation");
    bar.show(0.7, 43);
    none.show(0.7, 43);
    none.clear();
  }
  std::fclose(file);
  EXPECT_EQ(size, 0U);
  free(text);
}

}  // namespace
}  // namespace bsp2::jobs
