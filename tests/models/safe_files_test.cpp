// What a user has is not lost: inputs are not written over, nor what a stream leads to, nor snapshots of
// others.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "support/command.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

using bsp2::samples::Ended;
using bsp2::samples::run_command;

class SafeFiles : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;

  SafeFiles() {
    write("m.csg", "cube(2);");
    EXPECT_EQ(bsp2("run m.csg --boundary part.stl --snapshot s.h5 --quiet").code, 0);
    write("i.csg", "import(\"part.stl\"); cube(3);");
    write("field.txt", "0 0 0 0.5\n");
    fs::create_symlink("m.csg", path("link.h5"));
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_.path() / name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] Ended in_shell(const std::string& command) const {
    return run_command("(cd " + folder_.path().string() + "; " + command + ")");
  }
  [[nodiscard]] Ended bsp2(const std::string& arguments) const {
    return in_shell(BSP2_PROGRAM " " + arguments);
  }
};

TEST_F(SafeFiles, NothingThatIsReadIsWritten) {
  EXPECT_EQ(bsp2("run i.csg --snapshot i.h5 --quiet").code, 0);
  EXPECT_EQ(bsp2("mesh m.csg -o mesh.xdmf --size 1 --quiet").code, 0);
  const std::array<std::array<std::string, 3>, 12> wrong{
      {{"run m.csg --snapshot m.csg", "m.csg", "it is the input itself"},
       {"run m.csg --snapshot link.h5", "m.csg", "it is the input itself"},
       {"run m.csg --report m.csg", "m.csg", "it is the input itself"},
       {"run i.csg --boundary part.stl", "part.stl", "the model is made of it"},
       {"run i.csg --snapshot part.stl", "part.stl", "there is a file that is no snapshot"},
       {"run m.csg --snapshot part.stl", "part.stl", "there is a file that is no snapshot"},
       {"export i.h5 -o part.stl", "part.stl", "the model is made of it"},
       {"run m.csg --snapshot mesh.h5", "mesh.h5", "there is a file that is no snapshot"},
       {"mesh s.h5 -o s.xdmf", "s.h5", "which is a snapshot"},
       {"mesh m.csg -o s.xdmf", "s.h5", "which is a snapshot"},
       {"mesh m.csg -o a.msh --size-field field.txt --report field.txt", "field.txt",
        "it is the input itself"},
       {"mesh m.csg -o a.xdmf --report a.h5", "m.csg", "two outputs would be written to one file"}}};
  for (const auto& [arguments, file, words] : wrong) {
    const std::string before = content(file);
    const Ended ended = bsp2(arguments);
    EXPECT_EQ(ended.code, 2) << arguments << "\n" << ended.text;
    EXPECT_NE(ended.text.find(words), std::string::npos) << arguments << "\n" << ended.text;
    EXPECT_EQ(content(file), before) << arguments;
  }
  for (const char* arguments :
       {"resume s.h5 --quiet", "run m.csg --snapshot s.h5 --quiet", "mesh m.csg -o a.xdmf --size 1 --quiet",
        "mesh m.csg -o a.xdmf --size 1 --quiet", "run i.csg --boundary other.stl --quiet"})
    EXPECT_EQ(bsp2(arguments).code, 0) << arguments;
}

/// What a process has open already is written where it stands, be it a file, a pipe or a terminal.
TEST_F(SafeFiles, StreamsAreWrittenInPlace) {
  ASSERT_EQ(
      in_shell("(echo first; " BSP2_PROGRAM " run m.csg --quiet --report /dev/stdout; echo last) >> log")
          .code,
      0);
  const std::string log = content("log");
  EXPECT_TRUE(log.starts_with("first\n{")) << log;
  EXPECT_TRUE(log.ends_with("}\nlast\n") || log.ends_with("}last\n")) << log;
  for (const char* name : {"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"}) {
    const Ended ended = in_shell(BSP2_PROGRAM " run m.csg --quiet --report " + std::string(name) + " | cat");
    EXPECT_TRUE(ended.text.starts_with("{\n")) << name << ended.text;
  }
}

TEST_F(SafeFiles, RunsThatWriteOneSnapshotWaitForEachOther) {
  std::ofstream text(path("many.csg"));
  for (int i = 0; i < 30; ++i)
    text << "multmatrix([[1,0,0," << i << "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) sphere(1, $fn = 24);\n";
  text.close();
  std::array<Ended, 2> ended;
  for (int round = 0; round < 2; ++round) {
    std::array<std::thread, 2> runs;
    for (std::size_t k = 0; k < runs.size(); ++k)
      runs[k] = std::thread(
          [&, k] { ended[k] = bsp2("run many.csg --threads 1 --quiet --budget 5ms --snapshot c.h5"); });
    for (std::thread& run : runs) run.join();
    for (const Ended& each : ended) EXPECT_EQ(each.code, 0) << each.text;
    const Ended resumed = bsp2("resume c.h5 --quiet");
    EXPECT_EQ(resumed.code, 0) << resumed.text;
  }
  for (const auto& file : fs::directory_iterator(folder_.path()))
    EXPECT_FALSE(file.path().filename().string().starts_with(".")) << file.path();
}

/// A surface is closed, however little of the solid it is of.
TEST_F(SafeFiles, TheSurfaceOfAnUnfinishedRunIsToldOf) {
  const std::string model = BSP2_SOURCE_DIR "/examples/leaning_tower.csg";
  const Ended run = bsp2("run " + model + " --steps 1 --budget 10ms --threads 1 --quiet --snapshot u.h5");
  ASSERT_EQ(run.code, 0) << run.text;
  const std::array<std::string, 2> unfinished{
      "export u.h5 -o u.ply", "run " + model + " --budget 10ms --threads 1 --quiet --boundary u.ply"};
  for (const std::string& arguments : unfinished) {
    const Ended ended = bsp2(arguments);
    EXPECT_EQ(ended.code, 0) << ended.text;
    EXPECT_NE(ended.text.find("the run is not complete: 'u.ply' is the surface"), std::string::npos)
        << ended.text;
  }
  const Ended strict = bsp2("run " + model + " --budget 10ms --threads 1 -o D --strict");
  EXPECT_EQ(strict.code, 2) << strict.text;
  EXPECT_FALSE(fs::exists(path("D/solid.pvtu")));
  // Of the plane there is no surface, and with an outline an area.
  write("plane.csg", "difference() { square(9); circle(3, $fn = 400); circle(2, $fn = 401); }");
  const Ended plane = bsp2("run plane.csg --cells 1 --threads 1 --quiet -o P");
  EXPECT_EQ(plane.text.find("is the surface of"), std::string::npos) << plane.text;
}

}  // namespace
