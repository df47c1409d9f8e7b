#include <gtest/gtest.h>

#include <sstream>

#include "bsp2/geometry/error.hpp"
#include "bsp2/jobs/command_line.hpp"

namespace bsp2::jobs {
namespace {

RunCommand parsed(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  return parse_command_line(arguments, out).value();
}

std::string message_for(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  try {
    parse_command_line(arguments, out);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(CommandLine, WithoutOptionsNothingIsWrittenAndNoMeshIsHeld) {
  const RunCommand command = parsed({"run", "a.csg"});
  EXPECT_EQ(command.options.model, "a.csg");
  EXPECT_FALSE(command.options.collect_cells);
  EXPECT_FALSE(command.options.boundary);
  EXPECT_FALSE(command.folder || command.mesh || command.boundary || command.picture || command.report);
  EXPECT_TRUE(command.options.keep_in && command.options.keep_fuzzy && !command.options.keep_out);
}

TEST(CommandLine, AFolderNamesAllOutputs) {
  const RunCommand command = parsed({"run", "a.csg", "-o", "dir", "--picture", "p.png"});
  EXPECT_TRUE(command.options.collect_cells);
  EXPECT_EQ(command.mesh, "dir/solid.pvtu");
  EXPECT_EQ(command.report, "dir/report.json");
  EXPECT_EQ(command.picture, "p.png");
  EXPECT_EQ(command.boundary, "dir/boundary.stl");
  EXPECT_TRUE(command.options.boundary);
}

TEST(CommandLine, ABoundaryNeedsInCellsAndAKnownEnding) {
  const RunCommand command = parsed({"run", "a.csg", "--boundary", "b.ply"});
  EXPECT_EQ(command.boundary, "b.ply");
  EXPECT_TRUE(command.options.boundary && command.options.collect_cells);
  EXPECT_EQ(parsed({"run", "a.csg", "-o", "dir", "--boundary", "b.obj"}).boundary, "b.obj");
  EXPECT_NE(message_for({"run", "a.csg", "--boundary", "b.vtu"}).find("'b.vtu' must end in .stl, .ply, .obj or .vtp"), std::string::npos);
  EXPECT_NE(message_for({"run", "a.csg", "--boundary", "b.stl", "--keep", "out"}).find("--keep in"), std::string::npos);
  EXPECT_FALSE(parsed({"run", "a.csg", "-o", "dir", "--keep", "out"}).boundary);
}

TEST(CommandLine, CurvedAndToleranceReachTheRun) {
  const auto options = parsed({"run", "a.csg", "--curved", "--tolerance", "0.25"}).options;
  EXPECT_TRUE(options.curved);
  EXPECT_EQ(options.tolerance, 0.25);
  EXPECT_FALSE(parsed({"run", "a.csg"}).options.curved);
  EXPECT_NE(message_for({"run", "a.csg", "--tolerance", "0"}).find("--tolerance"), std::string::npos);
  EXPECT_NE(message_for({"run", "a.csg", "--tolerance", "nan"}).find("--tolerance"), std::string::npos);
}

TEST(CommandLine, OptionsReachTheRun) {
  const auto options =
      parsed({"run", "--threads", "3", "--regions=5", "--level", "7", "--budget", "500ms", "--cells", "100",
              "--coincidence", "0", "--order", "priority", "--keep", "out", "--keep", "in", "a.csg"})
          .options;
  EXPECT_EQ(options.threads, 3U);
  EXPECT_EQ(options.regions, 5U);
  EXPECT_EQ(options.level, 7U);
  EXPECT_DOUBLE_EQ(options.budget_seconds.value(), 0.5);
  EXPECT_EQ(options.cells, 100U);
  EXPECT_EQ(options.coincidence, 0.0);
  EXPECT_EQ(options.order, supersteps::Order::priority);
  EXPECT_TRUE(options.keep_in && !options.keep_fuzzy && options.keep_out);
  EXPECT_EQ(options.model, "a.csg");
}

TEST(CommandLine, TablesHaveNodesAndLevels) {
  EXPECT_EQ(parsed({"tables", "a.csg"}).tables, (std::vector<unsigned>{1, 2, 4, 8, 16}));
  const RunCommand command = parsed({"tables", "a.csg", "--regions", "1,3", "--levels", "8,12", "--threads", "1"});
  EXPECT_EQ(command.tables, (std::vector<unsigned>{1, 3}));
  EXPECT_EQ(command.levels, (std::vector<unsigned>{8, 12}));
  EXPECT_TRUE(parsed({"run", "a.csg"}).tables.empty());
}

TEST(CommandLine, MistakesAreExplainedWithAHint) {
  EXPECT_EQ(message_for({"run", "a.csg", "--frobnicate"}),
            "unknown option or argument '--frobnicate' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"fly"}), "unknown command 'fly' (see 'bsp2 --help')");
  EXPECT_NE(message_for({}).find("a command is required"), std::string::npos);
  for (const std::vector<std::string>& bad :
       std::vector<std::vector<std::string>>{{"run"},
                                             {"run", "a", "--threads", "-1"},
                                             {"run", "a", "--regions", "0"},
                                             {"run", "a", "--coincidence", "nan"},
                                             {"run", "a", "--coincidence", "-1"},
                                             {"run", "a", "--keep", "some"},
                                             {"run", "a", "--order", "wild"},
                                             {"run", "a", "--level", "1x"},
                                             {"run", "a", "--budget", "soon"},
                                             {"run", "a", "b"},
                                             {"run", "a", "--tets"}}) {
    EXPECT_NE(message_for(bad), "") << bad.back();
  }
}

TEST(CommandLine, TimesHaveUnits) {
  EXPECT_DOUBLE_EQ(parse_seconds("2s"), 2);
  EXPECT_DOUBLE_EQ(parse_seconds("1.5min"), 90);
  EXPECT_DOUBLE_EQ(parse_seconds("0.25"), 0.25);
  for (const char* bad : {"", "s", "0s", "-1s", "1.2.3s", "2 days", "nan", "inf", "1e3"}) {
    EXPECT_THROW(parse_seconds(bad), Error) << bad;
  }
}

TEST(CommandLine, HelpAndVersionArePrinted) {
  for (const std::vector<std::string>& ask :
       std::vector<std::vector<std::string>>{{"--help"}, {"run", "--help"}, {"--version"}}) {
    std::ostringstream out;
    EXPECT_FALSE(parse_command_line(ask, out));
    EXPECT_NE(out.str().find("bsp2"), std::string::npos);
    std::istringstream lines(out.str());
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
}

}  // namespace
}  // namespace bsp2::jobs
