#include "options/command_line.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "answers/point_query.hpp"
#include "bsp2/api/evaluation/run_options.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "options/work_options.hpp"
#include "outputs/film.hpp"
#include "outputs/outputs.hpp"
#include "outputs/pictures.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::jobs {
namespace {

using Paths = std::vector<std::filesystem::path>;

RunCommand parsed(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  return parse_command_line(arguments, out).value();
}

/// What the engine is asked for.
supersteps::RunOptions found_by(const RunCommand& command) {
  Options options = command.options;
  options.outputs_only = !command.points;
  return run_options(options);
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
  EXPECT_EQ(command.model, "a.csg");
  EXPECT_FALSE(found_by(command).collect_cells);
  EXPECT_FALSE(found_by(command).boundary);
  const Outputs& outputs = command.options.outputs;
  EXPECT_FALSE(outputs.folder || outputs.cells || !outputs.surfaces.empty() || outputs.picture ||
               outputs.report);
  EXPECT_TRUE(command.options.keep_in && command.options.keep_fuzzy && !command.options.keep_out);
}

TEST(CommandLine, AFolderNamesAllOutputs) {
  const RunCommand command = parsed({"run", "a.csg", "-o", "dir", "--picture", "p.png"});
  EXPECT_TRUE(found_by(command).collect_cells);
  EXPECT_EQ(command.options.outputs.cells, "dir/solid.pvtu");
  EXPECT_EQ(command.options.outputs.report, "dir/report.json");
  EXPECT_EQ(command.options.outputs.picture, "p.png");
  EXPECT_EQ(command.options.outputs.surfaces, Paths{"dir/boundary.stl"});
  EXPECT_TRUE(found_by(command).boundary);
}

TEST(CommandLine, ABoundaryNeedsInCellsAndAKnownEnding) {
  const RunCommand command = parsed({"run", "a.csg", "--boundary", "b.ply"});
  EXPECT_EQ(command.options.outputs.surfaces, Paths{"b.ply"});
  EXPECT_TRUE(found_by(command).boundary && found_by(command).collect_cells);
  EXPECT_EQ(parsed({"run", "a.csg", "-o", "dir", "--boundary", "b.obj", "--boundary", "b.3mf"})
                .options.outputs.surfaces,
            (Paths{"b.obj", "b.3mf"}));
  EXPECT_NE(message_for({"run", "a.csg", "--boundary", "b.vtu"}).find("'b.vtu' must end in .3mf, .amf,"),
            std::string::npos);
  EXPECT_NE(message_for({"run", "a.csg", "--boundary", "b.stl", "--keep", "out"}).find("--keep in"),
            std::string::npos);
  EXPECT_EQ(parsed({"run", "a.csg", "-o", "dir", "--keep", "out"}).options.outputs.surfaces, Paths{});
}

TEST(CommandLine, CurvedAndToleranceReachTheRun) {
  const auto options = parsed({"run", "a.csg", "--curved", "--tolerance", "0.25"}).options;
  EXPECT_TRUE(options.curved);
  EXPECT_EQ(options.tolerance, 0.25);
  EXPECT_FALSE(parsed({"run", "a.csg"}).options.curved);
  EXPECT_NE(message_for({"run", "a.csg", "--tolerance", "0"}).find("--tolerance"), std::string::npos);
  EXPECT_NE(message_for({"run", "a.csg", "--tolerance", "nan"}).find("--tolerance"), std::string::npos);
}

TEST(CommandLine, FilesHaveNames) {
  for (const char* option :
       {"-o", "--snapshot", "--boundary", "--picture", "--frames", "--series", "--report", "--table"}) {
    SCOPED_TRACE(option);
    EXPECT_NE(message_for({"run", "a.csg", option, ""}).find("needs a name"), std::string::npos)
        << message_for({"run", "a.csg", option, ""});
  }
  for (const std::vector<std::string>& inputs :
       std::vector<std::vector<std::string>>{{"run", ""},
                                             {"tables", ""},
                                             {"resume", ""},
                                             {"info", ""},
                                             {"export", "", "-o", "a.stl"},
                                             {"render", "", "-o", "a.png"},
                                             {"query", "", "--points", "p"},
                                             {"jobs", "split", "", "q"},
                                             {"jobs", "split", "a.csg", ""},
                                             {"jobs", "run", ""},
                                             {"jobs", "merge", ""},
                                             {"jobs", "status", ""}})
    EXPECT_NE(message_for(inputs).find(": needs a name, not an empty text (see 'bsp2 "), std::string::npos)
        << inputs[0] << ": " << message_for(inputs);
  for (const char* command : {"export", "render"})
    EXPECT_NE(message_for({command, "a.h5", "-o", ""}).find("needs a name"), std::string::npos) << command;
}

/// One table of each kind: what is printed, what a mistake names, and what the page shows.
TEST(CommandLine, FormatsOfSurfacesAreListed) {
  for (const char* command : {"run", "export"}) {
    std::ostringstream out;
    EXPECT_FALSE(parse_command_line({command, "--list-formats"}, out));
    EXPECT_EQ(out.str(), "Written (--boundary FILE):\n\n" + io::surface_format_table() +
                             "\nRead (as the model, or by import()):\n\n" + model::import_format_table());
  }
  const std::string table = io::surface_format_table();
  std::istringstream lines(table + model::import_format_table());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  const std::string mistake = message_for({"run", "a.csg", "--boundary", "b.gif"});
  for (const io::SurfaceFormat& format : io::surface_formats()) {
    EXPECT_NE(table.find("\n" + std::string(format.ending) + " "), std::string::npos) << format.ending;
    EXPECT_NE(mistake.find(format.ending), std::string::npos) << mistake;
  }
  EXPECT_EQ(message_for({"run", "a.csg", "-o", "b.gif"}), "") << "any folder";
  EXPECT_EQ(message_for({"export", "a.h5", "-o", "b.GLB"}), "");
  std::ifstream page(std::string(BSP2_SOURCE_DIR) + "/docs/formats.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  EXPECT_NE(text.find("```\n" + table + "```\n"), std::string::npos) << table;
  EXPECT_NE(text.find("```\n" + model::import_format_table() + "```\n"), std::string::npos);
}

TEST(CommandLine, AFolderIsNoSurface) {
  EXPECT_NE(message_for({"run", "a.csg", "-o", "part.stl"}).find("--boundary"), std::string::npos);
  EXPECT_EQ(parsed({"run", "a.csg", "-o", "part.v2"}).options.outputs.folder, "part.v2");
}

TEST(CommandLine, OptionsReachTheRun) {
  const auto options =
      parsed({"run", "--threads", "3", "--regions=5", "--level", "7", "--budget", "500ms", "--cells", "100",
              "--coincidence", "0", "--order", "priority", "--keep", "out", "--keep", "in", "a.csg"})
          .options;
  EXPECT_EQ(options.threads, 3U);
  EXPECT_EQ(options.regions, 5U);
  EXPECT_EQ(options.level, 7U);
  EXPECT_DOUBLE_EQ(options.budget.value(), 0.5);
  EXPECT_EQ(options.cells, 100U);
  EXPECT_EQ(options.coincidence, 0.0);
  EXPECT_EQ(options.order, Order::priority);
  EXPECT_TRUE(options.keep_in && !options.keep_fuzzy && options.keep_out);
}

/// The eye of --angle and --order view has any number of coordinates, and needs no picture.
TEST(CommandLine, AnglesNeedAnEye) {
  const auto options = parsed({"run", "a.csg", "--angle", "0.5", "--eye", "1,2,3,4"}).options;
  EXPECT_EQ(options.angle, 0.5);
  EXPECT_EQ(options.eye, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(parsed({"run", "a.csg", "--order", "view", "--eye", "1,2"}).options.eye,
            (std::vector<double>{1, 2}));
  EXPECT_NE(message_for({"run", "a.csg", "--angle", "0.5"}).find("add --eye"), std::string::npos);
  EXPECT_NE(message_for({"run", "a.csg", "--eye", "1,2,3"}).find("needs --angle or --order view"),
            std::string::npos);
  EXPECT_NE(message_for({"run", "a.csg", "--angle", "0.5", "--eye", "1,x"}).find("no point"),
            std::string::npos);
  for (const char* bad : {"0", "90", "-1", "nan"})
    EXPECT_NE(message_for({"run", "a.csg", "--eye", "1,2,3", "--angle", bad}), "") << bad;
}

TEST(CommandLine, PicturesHaveOneSetOfOptions) {
  for (const std::vector<std::string>& start :
       std::vector<std::vector<std::string>>{{"run", "a.csg", "--picture", "p.svg"},
                                             {"resume", "a.h5", "--picture", "p.svg"},
                                             {"render", "a.h5", "-o", "p.svg"}}) {
    std::vector<std::string> arguments = start;
    for (const char* more : {"--eye", "1,-2.5,3e1", "--look=0,0,1", "--explode", "0.5", "--edges", "--shade",
                             "region", "--size", "640x480"})
      arguments.emplace_back(more);
    const RunCommand command = parsed(arguments);
    EXPECT_EQ(command.options.outputs.picture, "p.svg");
    EXPECT_EQ(command.options.outputs.view.eye, (std::array{1.0, -2.5, 30.0}));
    EXPECT_EQ(command.options.outputs.view.look, (std::array{0.0, 0.0, 1.0}));
    EXPECT_EQ(command.options.outputs.view.explode, 0.5);
    EXPECT_EQ(command.options.outputs.view.edges, "cells");
    EXPECT_EQ(command.options.outputs.view.shade, "region");
    EXPECT_EQ(command.options.outputs.view.width, 640);
    EXPECT_EQ(command.options.outputs.view.height, 480);
  }
  EXPECT_EQ(parsed({"render", "a.h5", "-o", "p.png", "--look", "3,-4"}).options.outputs.view.look,
            (std::array{3.0, -4.0, 0.0}));
  EXPECT_NE(message_for({"render", "a.h5", "-o", "p.png", "--eye", "3,-4"}).find("--look X,Y"),
            std::string::npos);
  EXPECT_EQ(parsed({"render", "a.h5", "-o", "p.png"}).options.steps, 0U);
  EXPECT_NE(message_for({"render", "a.h5", "-o", "p.bmp"}).find("'p.bmp' must end in .png, .svg or .pdf"),
            std::string::npos);
  EXPECT_NE(
      message_for({"render", "a.h5", "-o", "p.png", "--shade", "rank"}).find("does not tell who computed"),
      std::string::npos);
  const RunCommand of_model =
      parsed({"render", "a.csg", "-o", "p.png", "--shade", "rank", "--curved", "--tolerance", "0.5"});
  EXPECT_EQ(of_model.model, "a.csg");
  EXPECT_FALSE(of_model.resume || of_model.options.steps || of_model.options.snapshot);
  EXPECT_TRUE(of_model.options.curved);
  EXPECT_EQ(of_model.options.tolerance, 0.5);
  EXPECT_NE(message_for({"run", "a", "--edges"}).find("--picture"), std::string::npos);
  EXPECT_EQ(parsed({"run", "--edges", "a.csg", "--picture", "a.png"}).options.outputs.view.edges, "cells");
  EXPECT_EQ(parsed({"run", "a.csg", "--edges", "feature", "--picture", "a.png"}).options.outputs.view.edges,
            "feature");
  EXPECT_NE(message_for({"run", "a.csg", "--picture", "a.png", "--edges", "features"})
                .find("did you mean 'feature'?"),
            std::string::npos);
  for (const char* bad : {"--eye=1,2", "--eye=1,2,x", "--eye=1,2,nan", "--look=,,", "--size=10", "--size=0x5",
                          "--size=9999x9999", "--size=1.5x2", "--explode=-1", "--shade=pink"})
    EXPECT_NE(message_for({"run", "a", "--picture", "p.png", bad}), "") << bad;
  EXPECT_NE(message_for({"run", "a", "--picture", "p.png", "--eye", "1,2,3", "--look", "1,2,3"}), "");
}

/// By what it holds or by what it is called, in all commands that take models, too.
TEST(CommandLine, SnapshotsAreToldFromModelsInOneWay) {
  samples::TemporaryFolder folder;
  const auto file = [&](const char* name, const char* bytes) {
    std::ofstream(folder.path() / name) << bytes;
    return (folder.path() / name).string();
  };
  const std::string called = file("called.h5", "no HDF5"), holds = file("holds.csg", "\x89HDF"),
                    model = file("model.csg", "cube();");
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"render", "-o", "a.png"}, {"draw", "-o", "a.svg"}, {"mesh", "-o", "a.msh"}, {"view"}}) {
    SCOPED_TRACE(command[0]);
    const auto of = [&](const std::string& input, std::vector<std::string> more = {}) {
      std::vector<std::string> arguments = command;
      arguments.insert(arguments.begin() + 1, input);
      arguments.insert(arguments.end(), more.begin(), more.end());
      return arguments;
    };
    for (const std::string& snapshot : {called, holds}) {
      const RunCommand shown = parsed(of(snapshot));
      EXPECT_EQ(shown.resume, snapshot);
      EXPECT_EQ(shown.options.steps, 0U);
      EXPECT_FALSE(shown.options.snapshot || shown.options.surface_only);
      for (const std::vector<std::string>& more :
           std::vector<std::vector<std::string>>{{"--curved"}, {"--tolerance", "1"}, {"--parts", "colour"}})
        EXPECT_NE(message_for(of(snapshot, more)).find("are those of the snapshot: leave them out"),
                  std::string::npos);
    }
    const RunCommand computed = parsed(of(model, {"--curved"}));
    EXPECT_EQ(computed.model, model);
    EXPECT_FALSE(computed.resume || computed.options.steps);
    EXPECT_TRUE(computed.options.curved);
  }
}

TEST(CommandLine, AnimationsMoveFromTheFirstPictureToTheLast) {
  const RunCommand command = parsed({"render", "a.h5", "-o", "f.apng", "--turntable", "4", "--explode", "0:3",
                                     "--sweep-section", "y:-1:8", "--grow", "--size", "90x80"});
  const auto& film = command.options.outputs.film;
  const auto looks = api::picture_options(command.options.outputs.view, supersteps::PictureFormat::png);
  ASSERT_TRUE(film);
  EXPECT_EQ(film->count, 4U);
  EXPECT_EQ(film->rate, 25);
  for (unsigned i = 0; i < 4; ++i) {
    const auto view = api::view_of(*film, looks, i, 9);
    EXPECT_EQ(view.turn, 90 * i);
    EXPECT_EQ(view.explode, i);
    ASSERT_TRUE(view.section);
    EXPECT_EQ(view.section->axis, 1);
    EXPECT_EQ(view.section->at, -1 + 3.0 * i);
    EXPECT_TRUE(view.section->keeps_upper);
    EXPECT_EQ(view.most_level, 3 * i);
    EXPECT_EQ(view.width, 90);
  }
  EXPECT_FALSE(parsed({"render", "a.h5", "-o", "p.png", "--explode", "2"}).options.outputs.film);
  samples::TemporaryFolder folder;
  const std::string path = folder.path() / "path.txt";
  std::ofstream(path) << "# eyes\n1 2 3\n\n5,2,3  0 0 1 # and what is looked at\n5 4 3\n";
  const auto along =
      parsed({"render", "a.h5", "-o", "f.apng", "--path", path, "--count", "5"}).options.outputs.film;
  ASSERT_TRUE(along);
  const auto eye = [&](unsigned i) { return api::view_of(*along, {}, i, 0).eye.value(); };
  EXPECT_EQ(eye(0), (std::array{1.0, 2.0, 3.0}));
  EXPECT_EQ(eye(1), (std::array{3.0, 2.0, 3.0}));
  EXPECT_EQ(eye(4), (std::array{5.0, 4.0, 3.0}));
  EXPECT_EQ(api::view_of(*along, {}, 1, 0).look, (std::array{0.0, 0.0, 1.0}));
  const auto fails = [&](std::vector<std::string> more, const std::string& text) {
    std::vector<std::string> arguments{"render", "a.h5", "-o"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const std::string message = message_for(arguments);
    EXPECT_NE(message.find(text), std::string::npos) << message;
  };
  fails({"f.apng", "--path", path, "--turntable", "4"}, "choose one");
  std::ofstream(path) << "1 2 3\n1 2\n";
  fails({"f.apng", "--path", path}, path + ":2: '1 2' is no camera");
  fails({"f.apng", "--path", path + "x"}, "cannot read");
  fails({"f.apng"}, "say how it moves");
  fails({"f.png", "--rate", "3"}, "say how it moves");
  fails({"f.png", "--grow"}, "an animation ends in .apng, .gif, .mp4 or .webm");
  fails({"f.apng", "--sweep-section", "w:0:1"}, "'w:0:1' is no way of a section");
  fails({"f.apng", "--sweep-section", "x:0"}, "--sweep-section x:0:100");
  fails({"f.apng", "--turntable", "0"}, "1 .. 100000");
  EXPECT_NE(
      message_for({"run", "a", "--picture", "p.png", "--explode", "0:1"}).find("a range is for animations"),
      std::string::npos);
}

TEST(CommandLine, FramesAreStepsOfTheirOwn) {
  const RunCommand command = parsed({"run", "a.csg", "--frames", "out/f_"});
  EXPECT_EQ(command.options.outputs.frames, "out/f_");
  EXPECT_EQ(command.options.budget, 1.0);
  EXPECT_TRUE(found_by(command).collect_cells);
  EXPECT_EQ(parsed({"run", "a.csg", "--frames", "f", "--budget", "3s"}).options.budget, 3.0);
  const RunCommand series = parsed({"run", "a.csg", "--series", "a.pvd", "--tets"});
  EXPECT_EQ(series.options.outputs.series, "a.pvd");
  EXPECT_EQ(series.options.budget, 1.0);
  EXPECT_NE(message_for({"run", "a.csg", "--series", "a.vtu"}).find("must end in .pvd"), std::string::npos);
  EXPECT_EQ(api::frame_path("out/f_", 7), "out/f_0007.png");
  EXPECT_EQ(api::frame_path("out/", 12345), "out/12345.png");
}

TEST(CommandLine, ExportsSurfacesAndCells) {
  EXPECT_EQ(parsed({"export", "a.h5", "-o", "b.vtp"}).options.outputs.surfaces, Paths{"b.vtp"});
  EXPECT_TRUE(found_by(parsed({"export", "a.h5", "-o", "b.stl"})).boundary);
  EXPECT_EQ(parsed({"export", "a.h5", "-o", "b.pvtu"}).options.outputs.cells, "b.pvtu");
  EXPECT_FALSE(parsed({"export", "a.h5", "-o", "b.pvtu"}).options.snapshot);
  EXPECT_NE(message_for({"export", "a.h5", "-o", "b.dwg"}), "");
  EXPECT_NE(message_for({"export", "a.h5", "-o", "b.stl", "--tets"}), "");
}

TEST(CommandLine, QueriesReadPointsOfTheDimension) {
  const RunCommand command = parsed({"query", "a.h5", "--points", "p.txt", "--json"});
  EXPECT_EQ(command.points, "p.txt");
  EXPECT_TRUE(command.json && command.quiet && found_by(command).collect_cells);
  EXPECT_NE(message_for({"query", "a.h5"}), "");
  std::istringstream text("# two points\n\n1 2,3  # the first\n\t-1e3, 0 0.5\n");
  EXPECT_EQ(read_points(text, "p", 3), (std::vector<double>{1, 2, 3, -1000, 0, 0.5}));
  for (const char* bad : {"1 2\n", "1 2 3 4\n", "1 2 x\n", "1 2 nan\n", "1 2 3\n,\n", "1 2 3z"}) {
    std::istringstream wrong(bad);
    EXPECT_THROW(read_points(wrong, "p", 3), Error) << bad;
  }
  std::istringstream far("1e150 -1e150 0\n1 -1e155 0\n");
  try {
    read_points(far, "p", 3);
    FAIL() << "the distance would be infinite";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "p:2: '1 -1e155 0' is too far away: coordinates have to be between -1e+150 and 1e+150");
  }
  std::ostringstream out;
  const double points[] = {0.5, 0.25, 4, 1};
  print_answers(out, points, {{label::in, label::out}, {7, -1}, {0, -1}, {-0.1, 3}, {0.5, 0.15, 1, 1}}, 2,
                false);
  EXPECT_EQ(out.str(),
            "x\ty\tlabel\tprimitive\tpart\tdistance\tnearest_x\tnearest_y\n0.5\t0.25\tIN\t7\t0\t-0.1\t0.5\t0."
            "15\n4\t1\tOUT\t-1\t-1\t3\t1\t1\n");
  std::ostringstream named;
  print_answers(named, std::span(points, 2), {{label::in}, {7}, {1}, {-0.1}, {0.5, 0.15}}, 2, false,
                {"base", "a post"});
  EXPECT_EQ(named.str(),
            "x\ty\tlabel\tprimitive\tpart\tdistance\tnearest_x\tnearest_y\tname\n0.5\t0.25\tIN\t7\t1\t-0."
            "1\t0.5\t0.15\ta post\n");
  std::ostringstream json;
  print_answers(json, {}, {}, 2, true);
  EXPECT_EQ(json.str(), "[]\n");
}

TEST(CommandLine, TablesHaveNodesAndLevels) {
  EXPECT_EQ(parsed({"tables", "a.csg"}).tables, (std::vector<unsigned>{1, 2, 4, 8, 16}));
  const RunCommand command =
      parsed({"tables", "a.csg", "--regions", "1,3", "--levels", "8,12", "--threads", "1"});
  EXPECT_EQ(command.tables, (std::vector<unsigned>{1, 3}));
  EXPECT_EQ(command.levels, (std::vector<unsigned>{8, 12}));
  EXPECT_FALSE(command.of_surface);
  EXPECT_TRUE(parsed({"tables", "a.csg", "--surface"}).of_surface);
  EXPECT_NE(message_for({"tables", "a.csg", "--surface", "--brief"}).find("--surface"), std::string::npos);
  EXPECT_TRUE(parsed({"run", "a.csg"}).tables.empty());
}

TEST(CommandLine, WorkersOfAQueueCanBeQuiet) {
  for (const std::vector<std::string>& ask : std::vector<std::vector<std::string>>{
           {"jobs", "split", "a.csg", "q"}, {"jobs", "run", "q"}, {"jobs", "merge", "q"}}) {
    std::vector<std::string> quiet = ask;
    quiet.emplace_back("--quiet");
    EXPECT_FALSE(parsed(ask).quiet);
    EXPECT_TRUE(parsed(quiet).quiet);
  }
}

TEST(CommandLine, MistakesAreExplainedWithAHint) {
  EXPECT_EQ(message_for({"run", "a.csg", "--frobnicate"}),
            "unknown option or argument '--frobnicate' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"run", "-x"}), "unknown option or argument '-x' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"run"}), "MODEL is required (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"jobs"}),
            "'bsp2 jobs' needs a command: split, run, merge or status (see 'bsp2 jobs --help')");
  EXPECT_EQ(message_for({"jobs", "fly"}), "unknown command 'bsp2 jobs fly' (see 'bsp2 jobs --help')");
  EXPECT_EQ(message_for({"jobs", "--all"}), "unknown option or argument '--all' (see 'bsp2 jobs --help')");
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

TEST(CommandLine, WhatIsMistypedIsSuggested) {
  EXPECT_EQ(message_for({"run", "a.csg", "--egde"}),
            "unknown option or argument '--egde'; did you mean '--edges'? (see 'bsp2 run --help')");
  EXPECT_EQ(
      message_for({"run", "a.csg", "--tolerence=0.1"}),
      "unknown option or argument '--tolerence=0.1'; did you mean '--tolerance'? (see 'bsp2 run --help')");
  EXPECT_EQ(
      message_for({"--quiet", "run", "a.csg"}),
      "unknown option or argument '--quiet'; it belongs after the command: 'bsp2 run --quiet' (see 'bsp2 "
      "run --help')");
  EXPECT_EQ(message_for({"rnu", "a.csg"}), "unknown command 'rnu'; did you mean 'run'? (see 'bsp2 --help')");
  EXPECT_EQ(message_for({"jobs", "mege", "q"}),
            "unknown command 'bsp2 jobs mege'; did you mean 'merge'? (see 'bsp2 jobs --help')");
  EXPECT_EQ(
      message_for({"run", "a.csg", "--picture", "p.png", "--shade", "parts"}),
      "--shade: must be part, rank, region, label, level, colour or color, not 'parts'; did you mean 'part'? "
      "(see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"run", "a.csg", "--keep", "inn"}),
            "--keep: must be in, fuzzy or out, not 'inn'; did you mean 'in'? (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"run", "a.csg", "--order", "wild"}),
            "--order: must be depth, priority or view, not 'wild' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"a.csg"}),
            "unknown command 'a.csg' (did you mean 'bsp2 run a.csg'? See 'bsp2 --help')");
}

std::string printed(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  EXPECT_FALSE(parse_command_line(arguments, out));
  return out.str();
}

/// A terminal has 24 lines, of which the prompt takes one.
TEST(CommandLine, HelpFitsAScreenAndHelpAllHasEverything) {
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{{},
                                                                                       {"run"},
                                                                                       {"resume"},
                                                                                       {"export"},
                                                                                       {"render"},
                                                                                       {"query"},
                                                                                       {"info"},
                                                                                       {"tables"},
                                                                                       {"draw"},
                                                                                       {"mesh"},
                                                                                       {"view"},
                                                                                       {"completion"}}) {
    std::vector<std::string> ask = command;
    ask.emplace_back("--help");
    const std::string text = printed(ask);
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 23) << text;
  }
  const std::string few = printed({"run", "--help"}), all = printed({"run", "--help-all"});
  EXPECT_NE(few.find("bsp2 run --help-all"), std::string::npos);
  EXPECT_EQ(few.find("--collect"), std::string::npos);
  for (const char* option :
       {"--output", "--collect", "--coincidence", "--shade", "--quiet", "What is written"})
    EXPECT_NE(all.find(option), std::string::npos);
}

TEST(CommandLine, ShellsCompleteCommandsOptionsAndValues) {
  EXPECT_EQ(printed({"__complete", "qu"}), "query\tTell where points are, and how far from the surface\n");
  EXPECT_EQ(printed({"__complete", "run", "--sh"}),
            "--shade\twhat colours tell: part, rank, region, label\n");
  EXPECT_EQ(printed({"__complete", "run", "a.csg", "--collect", "t"}), "tree\t\n");
  EXPECT_EQ(printed({"__complete", "run", "--collect", "=", "m"}), "master\t\n");
  EXPECT_EQ(printed({"__complete", "run", "--collect", "="}), "master\t\ntree\t\nfile\t\n");
  EXPECT_EQ(printed({"__complete", "run", ""}), ":files\n");
  EXPECT_EQ(printed({"__complete", "run", "a.csg", "-o", ""}), ":files\n");
  EXPECT_EQ(printed({"__complete", "run", "a.csg", "--level", ""}), "");
  EXPECT_EQ(printed({"__complete", "jobs", "s"}),
            "split\tMake a queue: a job a region\nstatus\tTell how far the jobs are\n");
  EXPECT_EQ(printed({"__complete", "completion", "f"}), "fish\t\n");
  EXPECT_EQ(printed({"__complete"}), "");
  for (const char* shell : {"bash", "zsh", "fish"})
    EXPECT_NE(printed({"completion", shell}).find("__complete"), std::string::npos);
}

/// Every option of every command is in the manual.
TEST(CommandLine, TheManualHasEveryOption) {
  const std::string page = printed({"manual"});
  EXPECT_TRUE(page.starts_with(".TH BSP2 1"));
  for (const char* text :
       {"\\-\\-boundary", "\\-\\-coincidence", ".SS bsp2 jobs split", "\\-\\-lease", ".SH EXIT STATUS"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
}

TEST(CommandLine, TheVersionNamesTheLibraries) {
  const std::string text = printed({"--version"});
  EXPECT_TRUE(text.starts_with("bsp2 "));
  for (const char* library : {"MPI", "Boost 1.", "HDF5 1.", "VTK 9.", "cairo 1."})
    EXPECT_NE(text.find(library), std::string::npos) << text;
}

TEST(CommandLine, NumbersOutOfTheirRangeAreNamedWithIt) {
  EXPECT_EQ(message_for({"run", "a", "--level", "-1"}),
            "--level: must be a whole number, 0 .. 65535, not '-1' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"jobs", "split", "a", "q", "--level", "65536"}),
            "--level: must be a whole number, 0 .. 65535, not '65536' (see 'bsp2 jobs split --help')");
  EXPECT_EQ(message_for({"jobs", "run", "q", "--job", "-1"}),
            "--job: must be a whole number, 0 or more, not '-1' (see 'bsp2 jobs run --help')");
  EXPECT_EQ(message_for({"run", "a", "--cells", "0"}),
            "--cells: must be a whole number, 1 or more, not '0' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"run", "a", "--picture", "p.png", "--explode", "-1"}),
            "--explode: must be a number, 0 .. 100, not '-1' (see 'bsp2 run --help')");
  EXPECT_EQ(message_for({"tables", "a", "--regions", "1,x"}),
            "--regions: must be a whole number, 1 .. 4096, not 'x' (see 'bsp2 tables --help')");
  EXPECT_EQ(parsed({"run", "a", "--level", "65535", "--explode", "100", "--picture", "p.png"}).options.level,
            65535U);
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
       std::vector<std::vector<std::string>>{{"--help"},
                                             {"run", "--help"},
                                             {"resume", "--help"},
                                             {"render", "--help"},
                                             {"query", "--help"},
                                             {"export", "--help"},
                                             {"tables", "--help"},
                                             {"jobs", "--help"},
                                             {"jobs", "split", "--help"},
                                             {"jobs", "run", "--help"},
                                             {"jobs", "merge", "--help"},
                                             {"--version"}}) {
    std::ostringstream out;
    EXPECT_FALSE(parse_command_line(ask, out));
    EXPECT_NE(out.str().find("bsp2"), std::string::npos);
    std::istringstream lines(out.str());
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
}

}  // namespace
}  // namespace bsp2::jobs
