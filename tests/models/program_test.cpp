// The program itself, as a person starts it: exit codes, messages, and what is left in the output folder.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "support/command.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

using bsp2::samples::Ended;

/// @param program which is started; else the arguments are a command of their own.
Ended start(const std::string& arguments, const std::string& program = BSP2_PROGRAM " ") {
  return bsp2::samples::run_command(program + arguments);
}

class Program : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;

  std::string model(const std::string& text) {
    const fs::path path = folder_.path() / "model.csg";
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  fs::path out() { return folder_.path() / "out"; }

  /// The user's mistake: one message that names the place, code 2, and no file.
  void expect_refused(const std::string& text, const std::string& mention) {
    const Ended ended = start("run " + model(text) + " -o " + out().string());
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find(mention), std::string::npos) << ended.text;
    EXPECT_EQ(ended.text.substr(0, 6), "bsp2: ");
    if (fs::exists(out())) {
      EXPECT_TRUE(fs::is_empty(out())) << text.substr(0, 80);
    }
  }
};

// However long ago writing failed, and whoever wrote.
TEST_F(Program, AFullDiskIsToldOf) {
  for (const std::string& arguments :
       {std::string("--version"), std::string("--help"), std::string("run --help"),
        "run --quiet --stats " + model("cube(1);")}) {
    const Ended ended = start("", "(" BSP2_PROGRAM " " + arguments + " > /dev/full)");
    EXPECT_EQ(ended.code, 2) << arguments;
    EXPECT_EQ(ended.text, "bsp2: cannot write to standard output: No space left on device\n") << arguments;
  }
}

TEST_F(Program, TwoOutputsNeedTwoNames) {
  const std::string cube = model("cube(1);"), here = folder_.path().string();
  for (const std::string& outputs : {"--report " + here + "/x --table " + here + "/x",
                                     "--snapshot " + here + "/a.stl --boundary " + here + "/./a.stl",
                                     "-o " + here + "/out --table " + here + "/out/report.json"}) {
    const Ended ended = start("run " + cube + " " + outputs);
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find("two outputs would be written to one file"), std::string::npos) << ended.text;
  }
  EXPECT_EQ(start("run " + cube + " --quiet --report /dev/null --table /dev/null").code, 0);
}

TEST_F(Program, WarnsOfWhatNobodyWants) {
  for (const auto& [text, warning] :
       {std::pair<std::string, std::string>{"difference() { cube(1); cube(2); }", "the solid is empty"},
        {"linear_extrude(height = 1) { text(text = \"a\xe6\x97\xa5\xe6\x9c\xac\"); }",
         "has no glyph for: \xe6\x97\xa5\xe6\x9c\xac"},
        {"multmatrix([[1, 0, 0, 1e6], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) { cube(0.1); }",
         "the single precision of .stl"}}) {
    const Ended ended =
        start("run --quiet " + model(text) + " --boundary " + (folder_.path() / "a.stl").string());
    EXPECT_EQ(ended.code, 0) << ended.text;
    EXPECT_NE(ended.text.find(warning), std::string::npos) << ended.text;
  }
}

// A part smaller than what single precision is cleaned by vanishes, which is told; a format of all digits
// keeps it.
TEST_F(Program, PartsThatCleaningWouldLoseAreToldOfOrKept) {
  const std::string far = model(
      "multmatrix([[1, 0, 0, 1e7], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) { cube(1);"
      "multmatrix([[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) { cube(0.01); } }");
  const auto written = [&](const char* name) {
    const Ended ended = start("run --quiet " + far + " --boundary " + (folder_.path() / name).string());
    EXPECT_EQ(ended.code, 0) << ended.text;
    return ended.text;
  };
  EXPECT_NE(written("a.stl").find("changes 1 of the 2 connected parts"), std::string::npos);
  EXPECT_EQ(written("a.off"), "");
  std::ifstream file(folder_.path() / "a.off");
  std::string off;
  std::size_t points = 0, triangles = 0;
  file >> off >> points >> triangles;
  EXPECT_EQ(triangles, 24U);
}

TEST_F(Program, RefusesBadModelsWithOneMessageAndNoFile) {
  expect_refused("", "empty");
  expect_refused("cube(size=[1,2,3])", ":1:");
  expect_refused("group() { cube(size=[1,2,", ":1:");
  expect_refused("\x93\x01\xff garbage", ":1:1:");
  expect_refused("cube();\n  warp() { circle(r = 1); }", ":2:3: there is no node 'warp'");
  expect_refused("polyhedron(points=[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],faces=[[0,1,2],[0,3,1],[0,2,3]]);",
                 "the edge from point 1 (1, 0, 0) to point 2");
  expect_refused("cylinder($fn = 1e9, h = 1, r1 = 1, r2 = 1);", "limit");
  expect_refused(
      "rotate_extrude($fn = 4000) { multmatrix([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) {"
      "circle($fn = 4000, r = 1); } }",
      "4,000 segments of 4,000 edges; the limit");
  std::string huge = "cube();";
  for (int i = 0; i < 3; ++i)
    huge = "multmatrix([[1e200,0,0,0],[0,1e200,0,0],[0,0,1e200,0],[0,0,0,1]]) {" + huge + "}";
  expect_refused(huge, "not finite");
}

TEST_F(Program, RefusesBadPathsAndOptions) {
  EXPECT_EQ(start("run " + (folder_.path() / "missing.csg").string()).code, 2);
  const Ended folder = start("run " + folder_.path().string());
  EXPECT_EQ(folder.code, 2);
  EXPECT_NE(folder.text.find("is a directory"), std::string::npos) << folder.text;
  const std::string good = model("cube(size = [1, 2, 3]);"), snapshot = (folder_.path() / "run.h5").string();
  EXPECT_EQ(start("run " + good + " --snapshot " + snapshot).code, 0);
  const Ended resumed = start("run " + snapshot);
  EXPECT_EQ(resumed.code, 2);
  EXPECT_NE(resumed.text.find("run.h5: is a snapshot, not a model; 'bsp2 info'"), std::string::npos)
      << resumed.text;
  std::ostringstream bytes;
  bytes << std::ifstream(snapshot, std::ios::binary).rdbuf();
  std::string damaged = bytes.str();
  damaged[1] = 'X';
  const std::string other = (folder_.path() / "damaged").string();
  std::ofstream(other, std::ios::binary) << damaged;
  const Ended drawn = start("render " + other + " -o " + (folder_.path() / "x.png").string());
  EXPECT_EQ(drawn.code, 2);
  EXPECT_NE(drawn.text.find("looks like a snapshot whose first bytes are damaged"), std::string::npos)
      << drawn.text;
  EXPECT_EQ(start("run " + good + " --bogus").code, 2);
  EXPECT_EQ(start("run " + good + " --cells -5").code, 2);
  EXPECT_EQ(start("run " + good + " --threads minus").code, 2);
  EXPECT_EQ(start("run " + good + " -o " + good).code, 2);  // a file where the folder should be
  EXPECT_EQ(start("run").code, 2);
  EXPECT_EQ(start("").code, 2);
  EXPECT_EQ(start("--help").code, 0);
}

/// What is named as a file and is none, or may not be read: one message that says so, code 2.
TEST_F(Program, TellsWhyAFileCannotBeRead) {
  const auto refused = [&](const std::string& arguments, const std::string& message) {
    const Ended ended = start("timeout 100 " BSP2_PROGRAM " " + arguments, "");
    EXPECT_EQ(ended.code, 2) << arguments << ": " << ended.text;
    EXPECT_EQ(ended.text, "bsp2: " + message + "\n");
  };
  const std::string folder = folder_.path().string(), pipe = folder + "/pipe", source = folder + "/pipe.scad",
                    loop = folder + "/loop.csg";
  for (const std::string& name : {pipe, source}) ASSERT_EQ(mkfifo(name.c_str(), 0600), 0);
  fs::create_symlink(loop, loop);
  refused("run " + loop, loop + ": cannot be read: Too many levels of symbolic links");
  refused("run -", "-: no such file; standard input is /dev/stdin");
  refused("run /dev/zero", "/dev/zero: is no text, so it holds no model: byte 0 is 0");
  refused("run " + source,
          source + ": is a pipe or a device, and OpenSCAD source has to be a file; save it as one");
  const std::string importing = model("import(\"pipe\");");
  refused("run " + importing, importing + ":1:1: import: " + pipe +
                                  " is a pipe or a device; save what it tells as a file and name that");
  for (const std::string command : {"resume ", "info "}) {
    refused(command + pipe,
            "cannot read '" + pipe + "': it is a pipe or a device, and a snapshot has to be a file");
    refused(
        command + folder,
        "'" + folder +
            "' is a folder without a snapshot.h5; name the file that 'bsp2 run' wrote with --snapshot or -o");
  }
  ASSERT_EQ(start("run " + model("cube(1);") + " --quiet -o " + out().string()).code, 0);
  refused("resume " + out().string(),
          "'" + out().string() + "' is a folder; its snapshot is '" + (out() / "snapshot.h5").string() + "'");
  const fs::path closed = folder_.path() / "closed";
  fs::create_directory(closed);
  std::ofstream(closed / "x.csg") << "cube(1);";
  fs::permissions(closed, fs::perms::none);
  if (geteuid() != 0)  // whom nothing is closed to
    refused("run " + closed.string() + "/x.csg",
            closed.string() +
                "/x.csg: cannot be read: Permission denied; it takes the right to read the file and to enter "
                "the folders above it");
  fs::permissions(closed, fs::perms::owner_all);
}

TEST_F(Program, ReadsAModelThroughAPipe) {
  const std::string text = model("cube(size = [1, 2, 3]);");
  const Ended ended = start("cat " + text + " | " BSP2_PROGRAM " run /dev/stdin", "");
  EXPECT_EQ(ended.code, 0) << ended.text;
  EXPECT_NE(ended.text.find("volume 6"), std::string::npos) << ended.text;
}

/// Told in one line, which is no warning, and only where the file could be looked for.
TEST_F(Program, TellsThatAPlaneModelHasNoBoundary) {
  const std::string line = "bsp2: no boundary.stl is written: the model is plane";
  const auto tells = [&](const char* text, const std::string& options) {
    const Ended ended = start("run " + model(text) + " --strict " + options);
    EXPECT_EQ(ended.code, 0) << ended.text;
    return ended.text.find(line) != std::string::npos;
  };
  const std::string folder = " -o " + out().string();
  EXPECT_TRUE(tells("square(2);", folder));
  EXPECT_FALSE(fs::exists(out() / "boundary.stl"));
  EXPECT_FALSE(tells("square(2);", folder + " --quiet"));
  EXPECT_FALSE(tells("square(2);", ""));
  EXPECT_FALSE(tells("cube(2);", folder));
}

TEST_F(Program, LeavesNoBlanksAtTheEndsOfLines) {
  const std::string snapshot = (folder_.path() / "run.h5").string(),
                    queue = (folder_.path() / "queue").string(), source = model("cube(1);");
  ASSERT_EQ(start("run " + source + " --quiet --snapshot " + snapshot).code, 0);
  ASSERT_EQ(start("jobs split " + source + " " + queue).code, 0);
  const auto expect_none = [&](const std::string& arguments) {
    const Ended ended = start(arguments);
    EXPECT_EQ(ended.code, 0) << ended.text;
    EXPECT_EQ((" " + ended.text).find(" \n"), std::string::npos) << ended.text;
  };
  for (const std::string& arguments :
       {"info " + snapshot, "run " + source + " --stats", "tables " + source + " --regions 1,2"})
    expect_none(arguments);
  expect_none("jobs status --all " + queue);  // to do
  ASSERT_EQ(start("jobs run " + queue).code, 0);
  expect_none("jobs status --all " + queue);  // finished
}

std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// With all outputs, a picture of a million pixels among them: 500 bytes a cell beyond 65 MB (72 to 75 MB
/// were seen in all, and threads differ).
TEST_F(Program, HoldsTheTowerInLittleMemory) {
  const fs::path report = out() / "report.json";
  EXPECT_EQ(start("run " + std::string(BSP2_SOURCE_DIR) +
                  "/examples/leaning_tower.csg --threads 2 --quiet -o " + out().string())
                .code,
            0);
  std::ifstream in(report);
  const auto json = nlohmann::json::parse(in);
  EXPECT_EQ(json["boundary"]["closed"], true);
  EXPECT_GT(json["cells"]["in"].get<double>(), 30000);
  EXPECT_LT(json["peak_rss_bytes"].get<double>(), 65e6 + 500 * json["cells"]["in"].get<double>());
}
#endif

TEST_F(Program, PrintsTheShareOfExactPredicates) {
  const Ended ended = start("run " + std::string(BSP2_SOURCE_DIR) + "/examples/mechanical_piece.csg --stats");
  EXPECT_EQ(ended.code, 0);
  EXPECT_NE(ended.text.find("exact fallbacks"), std::string::npos) << ended.text;
  EXPECT_NE(ended.text.find("% of the predicates)"), std::string::npos) << ended.text;
}

/// What a run into the same folder does not write is not left there by the one before.
TEST_F(Program, AFolderShowsOneRun) {
  const auto run = [&](const char* model, const char* options) {
    const fs::path path = folder_.path() / "model.csg";
    std::ofstream(path) << model;
    const Ended ended =
        start("run " + path.string() + " --quiet --strict " + options + " -o " + out().string());
    EXPECT_EQ(ended.code, 0) << ended.text;
    EXPECT_EQ(ended.text.find("warning"), std::string::npos) << ended.text;
    return fs::exists(out() / "boundary.stl");
  };
  EXPECT_TRUE(run("cube(1);", ""));
  EXPECT_FALSE(run("circle(1);", ""));
  EXPECT_TRUE(run("cube(1);", ""));
  EXPECT_FALSE(run("cube(1);", "--keep out"));
  // Of four dimensions only figures and the snapshot are written.
  const Ended figures = start("run " + model("simplex(dimension = 4);") + " -o " + out().string());
  EXPECT_EQ(figures.code, 0) << figures.text;
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(out())) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"report.json", "snapshot.h5"}));
  // A surface asked for by a name of its own is no such file.
  const fs::path mine = out() / "mine.stl";
  std::ofstream(mine) << "keep";
  const Ended ended =
      start("run " + model("circle(1);") + " -o " + out().string() + " --boundary " + mine.string());
  EXPECT_EQ(ended.code, 2) << ended.text;
  EXPECT_EQ(contents(mine.string()), "keep");
}

/// What is drawn, exported and asked of a snapshot is what the run would have written.
TEST_F(Program, SnapshotsCanBeDrawnExportedAndAsked) {
  const std::string path = (folder_.path() / "run.h5").string(),
                    picture = (folder_.path() / "a.png").string(),
                    surface = (folder_.path() / "a.ply").string();
  const std::string view = " --eye 9,-7,6 --explode 0.3 --shade part --edges --size 320x200";
  const std::string source = model(
      "difference() { cube(size = [2, 2, 2]); sphere($fn = 12, r = 1.5); } color([1, 0, 0, 1]) "
      "multmatrix([[1,0,0,3],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube();");
  ASSERT_EQ(start("run " + source + " --regions 8 --snapshot " + path + " --picture " + picture + view +
                  " --boundary " + surface)
                .code,
            0);
  const std::string drawn = (folder_.path() / "b.png").string(),
                    exported = (folder_.path() / "b.ply").string();
  EXPECT_EQ(start("render " + path + " -o " + drawn + view).text, "");
  const std::string note = start("export " + path + " -o " + exported).text;
  EXPECT_NE(note.find("note: the model has colours, which are not in " + exported), std::string::npos)
      << note;
  EXPECT_GT(contents(drawn).size(), 1000U);
  EXPECT_TRUE(contents(drawn) == contents(picture));
  EXPECT_GT(contents(exported).size(), 1000U);
  EXPECT_TRUE(contents(exported) == contents(surface));

  const fs::path points = folder_.path() / "points.txt";
  std::ofstream(points) << "# in the cube, outside, in the hollow\n3.5 0.5 0.25\n3.5,0.5,1.5\n0.1 0.1 0.1\n";
  const Ended answer = start("query " + path + " --points " + points.string());
  EXPECT_EQ(answer.code, 0);
  EXPECT_EQ(answer.text.substr(0, answer.text.find("0.1\t0.1\t0.1\tOUT\t-1\t")),
            "x\ty\tz\tlabel\tprimitive\tpart\tdistance\tnearest_x\tnearest_y\tnearest_z\n"
            "3.5\t0.5\t0.25\tIN\t2\t0\t-0.25\t3.5\t0.5\t0\n"
            "3.5\t0.5\t1.5\tOUT\t-1\t-1\t0.5\t3.5\t0.5\t1\n");
  EXPECT_EQ(start("query " + path + " --points - --json < " + points.string()).code, 0);
  std::ofstream(points) << "1 2 3\n1 2\n";
  const Ended wrong = start("query " + path + " --points " + points.string());
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.text.find("points.txt:2: "), std::string::npos) << wrong.text;
  EXPECT_EQ(start("query " + path + " --points " + (folder_.path() / "missing").string()).code, 2);
  EXPECT_EQ(start("render " + path + " -o " + picture + ".gif").code, 2);
  EXPECT_EQ(start("render " + source + "x -o " + picture).code, 2);
  // Of a model as well.
  const std::string of_model = (folder_.path() / "c.png").string();
  ASSERT_EQ(start("run " + source + " --picture " + picture).code, 0);
  EXPECT_EQ(start("render " + source + " -o " + of_model).code, 0);
  EXPECT_EQ(contents(of_model), contents(picture));
}

TEST_F(Program, StartsWithoutWhatMostRunsDoNotNeed) {
  const Ended libraries = start("", "LD_TRACE_LOADED_OBJECTS=1 " BSP2_PROGRAM);  // as ldd does
  EXPECT_NE(libraries.text.find("libstdc++"), std::string::npos) << libraries.text;
  for (const char* late : {"libvtk", "libhdf5", "libcairo", "libX11", "libharfbuzz", "libfontconfig",
                           "libfreetype", "libzip", "libcrypto"})
    EXPECT_EQ(libraries.text.find(late), std::string::npos) << libraries.text;
}

TEST_F(Program, TellsBeforeTheRunThatAModuleCannotBeLoaded) {
  const fs::path program = folder_.path() / "bin" / "bsp2";
  const fs::path modules =
      (program.parent_path() / fs::relative(BSP2_MODULES, fs::path(BSP2_PROGRAM).parent_path()))
          .lexically_normal();
  fs::create_directories(program.parent_path());
  fs::create_directories(modules);
  fs::copy_file(BSP2_PROGRAM, program);
  for (const char* module : {"bsp2-vtk.so", "bsp2-hdf5.so", "bsp2-cairo.so", "bsp2-pdf.so"})
    std::ofstream(modules / module) << "no library";
  const std::string run = " run " + model("cube(1);") + " ", at = folder_.path() / "result";
  const std::pair<std::string, std::string> all[] = {
      {"--series " + at + ".pvd", "bsp2-vtk.so"},   {"--boundary " + at + ".vtp", "bsp2-vtk.so"},
      {"--boundary " + at + ".pdf", "bsp2-pdf.so"}, {"--snapshot " + at + ".h5", "bsp2-hdf5.so"},
      {"--frames " + at, "bsp2-cairo.so"},          {"--picture " + at + ".png", "bsp2-cairo.so"}};
  for (const auto& [option, module] : all) {
    const Ended ended = start(run + option + " --report " + at + ".json", program);
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_EQ(ended.text.find("bsp2: cannot load '" + (modules / module).string() + "': "), 0U) << ended.text;
    EXPECT_FALSE(fs::exists(at + ".json")) << option;
  }
  fs::remove_all(modules);  // then those of the build folder are not taken instead
  for (const auto& [option, module] : all) {
    const Ended ended = start(run + option + " --report " + at + ".json", program);
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_EQ(ended.text.find("bsp2: cannot load " + module + ": it is not in '" + modules.string() + "'; "),
              0U)
        << ended.text;
    EXPECT_FALSE(fs::exists(at + ".json")) << option;
  }
  const Ended without =
      start(run + "--boundary " + at + ".stl --report " + at + ".json", program);  // what needs neither
  EXPECT_EQ(without.code, 0) << without.text;
  EXPECT_TRUE(fs::exists(at + ".stl"));
}

TEST_F(Program, DrawsAFrameOfEachStep) {
  const std::string tower = std::string(BSP2_SOURCE_DIR) + "/examples/menger_sponge.csg";
  EXPECT_EQ(
      start("run " + tower + " --frames " + (out() / "f").string() + " --budget 1ms --size 50x50 --quiet")
          .code,
      0);
  EXPECT_GT(contents(out() / "f0000.png").size(), 100U);
}

TEST_F(Program, WritesTheMeshOfEachStep) {
  const std::string sponge = std::string(BSP2_SOURCE_DIR) + "/examples/menger_sponge.csg";
  const fs::path series = out() / "a & b.pvd";
  EXPECT_EQ(start("run " + sponge + " --series '" + series.string() + "' --budget 1ms --quiet").code, 0);
  const std::string text = contents(series);
  std::size_t steps = 0;
  for (; fs::exists(out() / ("a & b_000" + std::to_string(steps) + ".pvtu")); ++steps)
    EXPECT_NE(text.find("file=\"a &amp; b_000" + std::to_string(steps) + ".pvtu\""), std::string::npos)
        << text;
  EXPECT_GT(steps, 0U);
  EXPECT_EQ(start("run " + sponge + " --series " + (out() / "x.pvtu").string()).code, 2);
}

TEST_F(Program, TakesOddNumbersAsOpenScadDoes) {
  for (const char* text : {"cube(size=[nan,1,1]);", "cube(size=[inf,1,1]);", "sphere(r=-1);", "group();",
                           "multmatrix([[1,0,0,0],[0,0,0,0],[0,0,1,0],[0,0,0,1]]) { cube(); }",
                           "multmatrix([[1,0,0,inf],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { cube(); }"}) {
    const Ended ended = start("run " + model(text) + " -o " + out().string());
    EXPECT_EQ(ended.code, 0) << text << ended.text;
    EXPECT_TRUE(fs::exists(out() / "report.json"));
  }
}

TEST_F(Program, IsStrictWhereItIsAskedTo) {
  const std::string open =
      "cube(9);\n polyhedron(points=[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],faces=[[0,1,2],[0,3,1],[0,2,3]]);";
  const Ended repaired = start("run " + model(open));
  EXPECT_EQ(repaired.code, 0) << repaired.text;
  EXPECT_NE(repaired.text.find(
                "model.csg:2:2: this polyhedron is not closed: the edge from point 1 (1, 0, 0) to point 2"),
            std::string::npos)
      << repaired.text;
  // One warning of the reader, one of a construct, one of compilation: each with its place, each an error.
  const std::pair<std::string, std::string> all[] = {
      {open, ":2:2: "},
      {"cube(1);\n\n rotate_extrude() { square(2, center = true); }", ":3:2: a rotate_extrude is empty"},
      {"cube(1);\n group() {\n  cube([1, 1, 1e-11]); }", ":3:3: 1 primitive is thinner"}};
  for (const auto& [text, place] : all) {
    const Ended strict = start("run --strict " + model(text) + " -o " + out().string());
    EXPECT_EQ(strict.code, 2) << strict.text;
    EXPECT_NE(strict.text.find(place), std::string::npos) << strict.text;
    EXPECT_FALSE(fs::exists(out() / "report.json"));
  }
  EXPECT_EQ(start("run --strict " + model("cube(1);")).code, 0);
}

/// An `openscad` of our own comes first on the PATH: the real one need not be there.
class Scad : public Program {
 protected:
  Ended start_with(const std::string& script) {
    const fs::path programs = folder_.path() / "programs";
    fs::create_directories(programs);
    std::ofstream(programs / "openscad") << "#!/bin/sh\n" << script << "\n";
    fs::permissions(programs / "openscad", fs::perms::owner_all);
    std::ofstream(folder_.path() / "a b.scad") << "cube(x);";
    const std::string before = std::getenv("PATH");
    setenv("PATH", (programs.string() + ":" + before).c_str(), 1);
    const Ended ended = start("run '" + (folder_.path() / "a b.scad").string() + "'");
    setenv("PATH", before.c_str(), 1);
    return ended;
  }
};

TEST_F(Scad, IsTranslatedByOpenscad) {
  const Ended ended =
      start_with("echo \"WARNING: odd $3\" >&2; test \"$1\" = -o && echo 'cube([1, 2, 3]);' > \"$2\"");
  EXPECT_EQ(ended.code, 0) << ended.text;
  EXPECT_NE(ended.text.find("volume 6"), std::string::npos) << ended.text;
  EXPECT_NE(ended.text.find("a b.scad: openscad: WARNING: odd " + folder_.path().string()), std::string::npos)
      << ended.text;
  const Ended part =
      start_with("echo \"WARNING: Ignoring unknown module 'part'\" >&2; echo 'cube([1, 2, 3]);' > \"$2\"");
  EXPECT_NE(part.text.find("'part'. OpenSCAD has no parts"), std::string::npos) << part.text;
  const Ended wrong = start_with("echo 'cube(' > \"$2\"");
  EXPECT_EQ(wrong.code, 2) << wrong.text;
  EXPECT_NE(wrong.text.find("a b.scad.csg:2:1: "), std::string::npos) << wrong.text;
}

/// Up to 2021 openscad writes what stands in a string as it is, later with backslashes before marks.
TEST_F(Scad, StringsAreThoseOfItsVersion) {
  const auto with = [this](const std::string& version, const std::string& name) {
    std::ofstream(folder_.path() / "made.csg") << "part(name = \"" << name << "\") { cube(1); }\n";
    const Ended ended =
        start_with("test \"$1\" = --version && echo 'OpenSCAD version " + version + "' >&2 && exit; cp '" +
                   (folder_.path() / "made.csg").string() + "' \"$2\"");
    EXPECT_EQ(ended.code, 0) << ended.text;
    return ended.text;
  };
  EXPECT_NE(with("2021.01", R"(6" pipe)").find(R"(6" pipe)"), std::string::npos);
  EXPECT_NE(with("2021.01", R"(a\b\)").find(R"(a\b\)"), std::string::npos);
  EXPECT_NE(with("2021.01", R"(a") b)").find(R"(a") b)"), std::string::npos);
  EXPECT_NE(with("2024.12.06", R"(6\" pipe)").find(R"(6" pipe)"), std::string::npos);
}

TEST_F(Scad, IsAnErrorIfOpenscadFails) {
  const Ended failed = start_with("echo 'ERROR: no such thing'; exit 1");
  EXPECT_EQ(failed.code, 2) << failed.text;
  EXPECT_NE(failed.text.find("openscad failed: ERROR: no such thing"), std::string::npos) << failed.text;
  EXPECT_EQ(start_with("exit 0").code, 2) << "nothing is written";
  const Ended asserted = start_with("echo 'ERROR: Assertion failed'; echo > \"$2\"");
  EXPECT_EQ(asserted.code, 2) << asserted.text;
  EXPECT_NE(asserted.text.find("openscad failed: ERROR: Assertion failed"), std::string::npos)
      << asserted.text;
  EXPECT_EQ(start_with("kill -9 $$").code, 2);
  // A library that is not there leaves no node, and no exit code: what was said of it is why.
  const Ended without = start_with(
      "echo \"WARNING: Can't open include file 'BOSL2/std.scad'.\"; for i in 1 2 3; do echo 'WARNING: "
      "Ignoring x'; done; echo > \"$2\"");
  EXPECT_EQ(without.code, 2) << without.text;
  EXPECT_NE(without.text.find("holds no model: openscad makes nothing of it, and says: WARNING: Can't open "
                              "include file 'BOSL2/std.scad'.; WARNING: Ignoring x "
                              "(3 times). Install what is missing"),
            std::string::npos)
      << without.text;
  EXPECT_NE(start_with("echo > \"$2\"").text.find("holds no model: openscad makes nothing of it\n"),
            std::string::npos);
  // Nor is it lost where the text is none.
  const Ended damaged = start_with("echo 'WARNING: odd'; echo 'cube(' > \"$2\"");
  EXPECT_NE(damaged.text.find("; before that, "), std::string::npos) << damaged.text;
  EXPECT_NE(damaged.text.find("openscad: WARNING: odd"), std::string::npos) << damaged.text;
  const std::string before = std::getenv("PATH");
  std::ofstream(folder_.path() / "m.scad") << "cube();";
  setenv("PATH", folder_.path().c_str(), 1);
  const Ended missing = start("run " + (folder_.path() / "m.scad").string());
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(missing.code, 2) << missing.text;
  EXPECT_NE(missing.text.find("not installed"), std::string::npos) << missing.text;
}

/// What may be solid and is FUZZY has no surface: a file without triangles is told of.
TEST_F(Program, TellsOfASurfaceThatIsNotThereYet) {
  const Ended ended = start("run --curved --tolerance 100 --boundary " + (folder_.path() / "a.stl").string() +
                            " " + model("sphere(r = 5, $fn = 0);"));
  EXPECT_EQ(ended.code, 0) << ended.text;
  EXPECT_NE(ended.text.find("no cell is IN, what may be solid is in 1 FUZZY cell"), std::string::npos)
      << ended.text;
}

/// Where planes that are one leave nothing, it is said that they are.
TEST_F(Program, TellsThatMergingLeavesNothing) {
  const std::string thin =
      "difference() { cube(10); multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,-1e-10],[0,0,0,1]]) cube(10); }";
  const Ended merged = start("run " + model(thin));
  EXPECT_EQ(merged.code, 0) << merged.text;
  EXPECT_NE(merged.text.find("the solid is empty; "), std::string::npos) << merged.text;
  EXPECT_NE(merged.text.find("--coincidence 0 keeps all"), std::string::npos) << merged.text;
  EXPECT_EQ(start("run --coincidence 0 " + model(thin)).text.find("the solid is empty"), std::string::npos);
  EXPECT_NE(start("run " + model("difference() { cube(1); cube(2); }")).text.find("the solid is empty\n"),
            std::string::npos)
      << "nothing is merged";
}

TEST_F(Program, EvaluatesDeepNesting) {
  for (const std::string node : {"group() {", "difference() { cube(size = [9, 9, 9]);",
                                 "multmatrix([[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) {"}) {
    std::string text;
    for (int i = 0; i < 10000; ++i) text += node;
    text += "cube();";
    for (int i = 0; i < 10000; ++i) text += "}";
    const Ended ended = start("run " + model(text));
    EXPECT_EQ(ended.code, 0) << node << ended.text;
  }
}

TEST_F(Program, WritesWhatItWasAskedFor) {
  const Ended ended = start("run " + model("difference() { cube(size=[4,4,4]); sphere($fn=8,r=2); }") +
                            " -o " + out().string());
  EXPECT_EQ(ended.code, 0) << ended.text;
  for (const char* name : {"report.json", "solid.pvtu", "boundary.stl", "view.png", "snapshot.h5"})
    EXPECT_TRUE(fs::exists(out() / name)) << name;
  EXPECT_NE(ended.text.find("closed"), std::string::npos);
  for (std::size_t begin = 0; begin < ended.text.size();) {  // fits a terminal
    const std::size_t end = std::min(ended.text.find('\n', begin), ended.text.size());
    const std::string line = ended.text.substr(begin, end - begin);
    if (line.find(folder_.path().string()) == std::string::npos) {
      EXPECT_LE(line.size(), 80U) << line;
    }
    begin = end + 1;
  }
}

}  // namespace
