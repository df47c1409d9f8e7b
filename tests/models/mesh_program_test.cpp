// `bsp2 mesh` from the model to the file: what each file says of the mesh, read back as text.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/command.hpp"
#include "support/listening.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;

using samples::Ended;

Ended mesh(const std::string& arguments) { return samples::run_command(BSP2_PROGRAM " mesh " + arguments); }

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class MeshProgram : public testing::Test {
 protected:
  MeshProgram() {
    std::ofstream(model_)
        << "part(name=\"a\") cube([2, 2, 1]);\n"
           "part(name=\"b\") multmatrix([[1,0,0,0.5],[0,1,0,0.5],[0,0,1,1],[0,0,0,1]]) cube([1, 1, 1]);\n";
  }
  samples::TemporaryFolder folder_;
  fs::path model_ = folder_.path() / "model.csg", report_ = folder_.path() / "report.json";

  nlohmann::json report() { return nlohmann::json::parse(content_of(report_)).at("solver_mesh"); }
  Ended run(const std::string& file, const std::string& options = "") {
    return mesh(model_.string() + " -o " + (folder_.path() / file).string() + " --report " +
                report_.string() + " " + options);
  }
};

TEST_F(MeshProgram, FilesHoldVolumesAndGroups) {
  const Ended ended = run("a.msh", "--size 0.7 --group 'floor=z==min'");
  ASSERT_EQ(ended.code, 0) << ended.text;
  EXPECT_NEAR(report().at("volume").get<double>(), 5, 1e-9);
  EXPECT_NEAR(report().at("volumes").at("a").get<double>(), 4, 1e-9);
  for (const char* group : {"floor", "a|outside", "b|outside", "a|b"})
    EXPECT_GT(report().at("groups").at(group).get<int>(), 0) << group;
  const std::string text = content_of(folder_.path() / "a.msh");
  EXPECT_NE(text.find("$MeshFormat\n4.1 0 8\n"), std::string::npos);
  EXPECT_NE(text.find("\"a|b\""), std::string::npos);
  ASSERT_EQ(run("a.inp", "--size 0.7 --element-order 2").code, 0);
  const std::string inp = content_of(folder_.path() / "a.inp");
  for (const char* line : {"TYPE=C3D10, ELSET=a\n", "TYPE=C3D10, ELSET=b\n",
                           "*SURFACE, NAME=a_b, TYPE=ELEMENT\n", "*NSET, NSET=a_outside\n"})
    EXPECT_NE(inp.find(line), std::string::npos) << line;
}

/// The program, to be ended by a signal. What it says goes to a file.
class Meshing {
 public:
  Meshing(const std::vector<std::string>& arguments, const fs::path& output) : output_(output) {
    child_ = fork();
    if (child_ != 0) return;
    const int out = open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    std::vector<char*> words{const_cast<char*>(BSP2_PROGRAM), const_cast<char*>("mesh")};
    for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    execv(BSP2_PROGRAM, words.data());
    _exit(127);
  }
  /// Sends a signal when it has been handled for so long. @return how it ended within a minute, else killed.
  Ended end(int signal, std::chrono::milliseconds after) {
    samples::wait_for_handler(child_, signal);
    std::this_thread::sleep_for(after);
    kill(child_, signal);
    int status = 0;
    for (const auto late = Clock::now() + std::chrono::minutes(1); waitpid(child_, &status, WNOHANG) == 0;
         std::this_thread::sleep_for(std::chrono::milliseconds(5)))
      if (Clock::now() > late) kill(child_, SIGKILL);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), content_of(output_)};
  }

 private:
  using Clock = std::chrono::steady_clock;
  fs::path output_;
  pid_t child_;
};

/// Of millions of tetrahedra, which take many minutes; and the answer of an earlier run stays.
TEST_F(MeshProgram, ASignalEndsItAndNothingIsWritten) {
  const fs::path file = folder_.path() / "a.msh";
  std::ofstream(file) << "earlier";
  std::chrono::milliseconds delay(200);
  int in_the_mesh = 0;
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGTERM, SIGTERM, SIGTERM}) {
    Meshing meshing({model_, "-o", file, "--size", "0.01", "--report", report_}, folder_.path() / "text");
    const Ended ended = meshing.end(signal, delay);
    EXPECT_EQ(ended.code, 75) << ended.text;
    EXPECT_EQ(content_of(file), "earlier");
    EXPECT_FALSE(fs::exists(report_));
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      EXPECT_NE(entry.path().filename().string().front(), '.') << entry.path();
    const bool is_told =
        ended.text.find("interrupted; '" + file.string() + "' is not written") != std::string::npos;
    in_the_mesh += is_told ? 1 : 0;
    if (in_the_mesh == 3) return;
    if (!is_told) delay *= 4;  // the cells were not there yet
  }
  EXPECT_GT(in_the_mesh, 0);
}

TEST_F(MeshProgram, GroupsAreHalfSpacesColoursAndSmoothPieces) {
  std::ofstream(model_)
      << "part(name=\"a\") color(\"red\") cube([2, 2, 1]);\n"
         "part(name=\"b\") color(\"#0000ff\") multmatrix([[1,0,0,0.5],[0,1,0,0.5],[0,0,1,1],"
         "[0,0,0,1]]) cube([1, 1, 1]);\n";
  const std::string groups =
      "--group 'corner=x+y<=2 & z==0' --group 'seam=colour==red & colour==blue' "
      "--group 'side=colour==blue & angle<=30' --group 'nowhere=colour==green'";
  for (const char* type : {"--size 0", "--type polyhedra"}) {
    const Ended ended = run("a.vtu", groups + " " + type);
    ASSERT_EQ(ended.code, 0) << ended.text;
    EXPECT_NE(ended.text.find("--group nowhere: no face is where it says"), std::string::npos) << ended.text;
    const auto found = report().at("groups");
    for (const char* group : {"seam", "side_1", "side_2", "side_3", "side_4", "side_5", "a|outside"})
      EXPECT_TRUE(found.contains(group)) << group << found;
    EXPECT_FALSE(found.contains("side_6") || found.contains("side") || found.contains("b|outside")) << found;
    EXPECT_TRUE(found.contains("corner") || std::string(type) != "--size 0") << found;
  }
}

TEST_F(MeshProgram, NamesThatSolversTakeForOneStayTwo) {
  const Ended ended = run("a.inp", "--size 1 --group 'a b=x==min' --group 'a_b=x==max' --group 'A b=y==min'");
  ASSERT_EQ(ended.code, 0) << ended.text;
  const std::string inp = content_of(folder_.path() / "a.inp");
  for (const char* name : {"a_b", "A_b_2", "a_b_3"}) {
    const std::string line = "*NSET, NSET=" + std::string(name) + "\n";
    EXPECT_NE(inp.find(line), std::string::npos) << name;
    EXPECT_EQ(inp.find(line), inp.rfind(line)) << name;
  }
}

/// What is in one plane may be outside and between parts: still one group of solvers, and of OpenFOAM a patch
/// and a zone.
TEST_F(MeshProgram, GroupsMayBeOutsideAndBetweenParts) {
  const std::string group = " --group 'level=z==1'";
  const Ended ended = run("a.inp", "--size 1" + group);
  ASSERT_EQ(ended.code, 0) << ended.text;
  EXPECT_EQ(ended.text.find("level"), ended.text.rfind("level")) << ended.text;
  const std::string inp = content_of(folder_.path() / "a.inp");
  for (const char* line : {"*NSET, NSET=level\n", "*SURFACE, NAME=level, TYPE=ELEMENT\n"}) {
    EXPECT_NE(inp.find(line), std::string::npos) << line;
    EXPECT_EQ(inp.find(line), inp.rfind(line)) << line;
  }
  ASSERT_EQ(run("case", "--type polyhedra" + group).code, 0);
  EXPECT_EQ(report().at("groups").at("level"), 5);  // four around b, one below it
  for (const char* file : {"boundary", "faceZones"})
    EXPECT_NE(content_of(folder_.path() / "case" / "constant" / "polyMesh" / file).find("level"),
              std::string::npos)
        << file;
  // Not so what has one name by chance.
  std::ofstream(model_) << "part(name=\"b\") cube(2); part(name=\"outside\") "
                           "multmatrix([[1,0,0,2],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube(2);\n";
  ASSERT_EQ(run("case", "--type polyhedra").code, 0);
  const std::string zones = content_of(folder_.path() / "case" / "constant" / "polyMesh" / "faceZones");
  EXPECT_NE(zones.find("1\n(\n"), std::string::npos) << zones;
  const Ended told = run("a.vtu", "--size 1 --group 'level=z==0'");
  EXPECT_NE(told.text.find("groups of faces are not in 'a.vtu'"), std::string::npos) << told.text;
}

TEST_F(MeshProgram, WhatCleaningTakesAwayIsToldAndWarnedOf) {
  std::ofstream(model_)
      << "cube([2, 2, 1]); multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,1],[0,0,0,1]]) cube([1, 2, 0.4]);\n";
  const Ended some = run("a.msh", "--size 1 --clean 0.001");
  ASSERT_EQ(some.code, 0) << some.text;
  EXPECT_EQ(some.text.find("warning"), std::string::npos) << some.text;
  const Ended much = run("a.msh", "--size 1 --clean 0.9");
  ASSERT_EQ(much.code, 0) << much.text;
  EXPECT_NE(much.text.find("warning"), std::string::npos) << much.text;
  EXPECT_NE(much.text.find(" %)"), std::string::npos) << much.text;
}

TEST_F(MeshProgram, PartsThatAreAbsorbedAreWarnedOf) {
  std::ofstream(model_) << "part(name=\"block\") cube([10, 10, 10]);\n"
                           "part(name=\"film\") multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,10],[0,0,0,1]]) "
                           "cube([0.05, 0.05, 0.00000005]);\n";
  const Ended ended = run("a.msh", "--size 1000");
  ASSERT_EQ(ended.code, 0) << ended.text;
  EXPECT_NE(ended.text.find("warning: part 'film' is not in the mesh"), std::string::npos) << ended.text;
  EXPECT_EQ(ended.text.find("part 'block'"), std::string::npos) << ended.text;
  EXPECT_EQ(run("a.msh", "--size 1000 --strict").code, 2);
}

TEST_F(MeshProgram, OpenFoamCasesHavePatchesAndZones) {
  const Ended ended = run("case");
  ASSERT_EQ(ended.code, 0) << ended.text;
  const fs::path mesh = folder_.path() / "case" / "constant" / "polyMesh";
  for (const char* file : {"points", "faces", "owner", "neighbour"})
    EXPECT_TRUE(fs::exists(mesh / file)) << file;
  EXPECT_NE(content_of(mesh / "boundary").find("a_outside"), std::string::npos);
  EXPECT_NE(content_of(mesh / "cellZones").find("cellZone"), std::string::npos);
  EXPECT_NE(content_of(mesh / "faceZones").find("a_b"), std::string::npos);
  EXPECT_NEAR(report().at("volume").get<double>(), 5, 1e-9);
}

/// ParaView opens the empty file, which is in the case's folder whichever of the two is named.
TEST_F(MeshProgram, OpenFoamCasesAreOpenedByOneFile) {
  for (const char* name : {"case", "case.foam", "case/case.foam"}) {
    const Ended ended = run(name, "--size 2");
    ASSERT_EQ(ended.code, 0) << ended.text;
    const fs::path marker = folder_.path() / "case" / "case.foam";
    EXPECT_TRUE(fs::is_regular_file(marker) && fs::is_empty(marker)) << name;
    EXPECT_NE(ended.text.find("   " + marker.string() + "\n"), std::string::npos) << ended.text;
    EXPECT_TRUE(fs::exists(folder_.path() / "case" / "constant" / "polyMesh" / "points")) << name;
    fs::remove_all(folder_.path() / "case");
  }
  std::ofstream(folder_.path() / "case") << "a file";
  const Ended ended = run("case");
  EXPECT_EQ(ended.code, 2) << ended.text;
  EXPECT_NE(ended.text.find("is a file"), std::string::npos) << ended.text;
}

/// A model none of which is known to be solid is not called empty.
TEST_F(MeshProgram, WhatIsAllFuzzyIsToldApartFromWhatIsEmpty) {
  std::ofstream(model_) << "sphere(r = 5, $fn = 0);\n";
  const Ended fuzzy = run("a.msh", "--curved --tolerance 100");
  EXPECT_EQ(fuzzy.code, 2) << fuzzy.text;
  EXPECT_NE(fuzzy.text.find("nothing to mesh: no cell is IN"), std::string::npos) << fuzzy.text;
  std::ofstream(model_) << "difference() { cube(1); cube(2); }\n";
  const Ended empty = run("a.msh");
  EXPECT_EQ(empty.code, 2) << empty.text;
  EXPECT_NE(empty.text.find("nothing to mesh: the solid is empty"), std::string::npos) << empty.text;
}

/// What is absorbed is small against a piece of the solid, not against the way from one to another.
TEST_F(MeshProgram, PiecesThatAreFarApartAreKept) {
  std::ofstream(model_) << "cube([1, 1, 1]);\n"
                           "multmatrix([[1,0,0,5000000],[0,1,0,0],[0,0,1,300],[0,0,0,1]]) cube([1, 2, 1]);\n";
  const Ended kept = run("a.msh");
  ASSERT_EQ(kept.code, 0) << kept.text;
  EXPECT_NEAR(report().at("volume").get<double>(), 3, 1e-9);
  const Ended gone = run("a.msh", "--clean 5");
  EXPECT_EQ(gone.code, 2) << gone.text;
  EXPECT_NE(gone.text.find("nothing is left to mesh"), std::string::npos) << gone.text;
}

TEST_F(MeshProgram, SizesAreReadFromATable) {
  const fs::path table = folder_.path() / "sizes.csv";
  std::ofstream(table) << "x,y,z,size\n0, 0, 0, 0.2  # fine\n\n2 2 0\t0.8\n";
  ASSERT_EQ(run("a.msh", "--size-field " + table.string()).code, 0);
  const auto points = report().at("points").get<int>();
  EXPECT_EQ(report().at("size").get<double>(), 0.8);
  ASSERT_EQ(run("a.msh", "--size-field " + table.string() + " --growth 0.2").code, 0);
  EXPECT_GT(report().at("points").get<int>(), points);
  for (const char* wrong :
       {"0 0 0 nan\n1 2 3 1\n", "1 2 3 0\n", "0 0 0 1\n1 2 3\n", "0 0 0 1\n1 2 3 4 5\n", "x y z\n"}) {
    std::ofstream(table) << wrong;
    const Ended ended = run("a.msh", "--size-field " + table.string());
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find("sizes.csv:"), std::string::npos) << ended.text;
  }
}

/// A field in another unit than the model's.
TEST_F(MeshProgram, FieldsThatWouldMakeTooManyTetrahedraAreRefused) {
  const fs::path table = folder_.path() / "sizes.txt";
  std::ofstream(table) << "0 0 0 1e-6\n";
  const Ended much = run("a.msh", "--size 1 --size-field " + table.string());
  EXPECT_EQ(much.code, 2) << much.text;
  EXPECT_NE(much.text.find("sizes are in the units of the model"), std::string::npos) << much.text;
  std::ofstream(table) << "0 0 0 1e-6\n1e-5 1e-5 1e-5 1\n";  // one small place is no mistake
  const Ended little = run("a.msh", "--size 1 --size-field " + table.string());
  EXPECT_EQ(little.code, 0) << little.text;
}

/// Names are of one line, and a group is not all nodes.
TEST_F(MeshProgram, NamesStandInFilesAsTheyMust) {
  std::ofstream(model_) << "part(name=\"new\\nline\") cube([2, 2, 1]);\n";
  ASSERT_EQ(run("a.msh", "--size 1").code, 0);
  const Ended checked = mesh("--check " + (folder_.path() / "a.msh").string());
  EXPECT_EQ(checked.code, 0) << checked.text;
  ASSERT_EQ(run("a.inp", "--size 1 --group 'all=x==min'").code, 0);
  const std::string inp = content_of(folder_.path() / "a.inp");
  EXPECT_NE(inp.find("*NODE, NSET=all\n"), std::string::npos);
  EXPECT_NE(inp.find("*NSET, NSET=all_2\n"), std::string::npos);
}

TEST_F(MeshProgram, MistakesAreToldInOneMessage) {
  const std::array<std::array<const char*, 3>, 8> wrong{
      {{"a.xyz", "", "must end in"},
       {"a.inp", "--type polyhedra", "hold polyhedra"},
       {"case", "--element-order 2", "--element-order 2"},
       {"a.inp", "--msh-version 4.1", "is of .msh files"},
       {"a.msh", "--part-size c=1", "has no part 'c'"},
       {"a.msh", "--size 1e-5", "sizes are in the units of the model"},
       {"a.msh", "--group q", "NAME=WHERE"},
       {"a.msh", "--group q=colur==red", "did you mean 'colour'?"}}};
  for (const auto& [file, options, words] : wrong) {
    const Ended ended = run(file, options);
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find(words), std::string::npos) << ended.text;
  }
}

#ifdef BSP2_MPIEXEC
/// Each rank makes the polyhedra of its own cells: of parts, of what is round, and of a snapshot.
TEST_F(MeshProgram, FilesAreTheSameOnAnyNumberOfRanks) {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  const std::string snapshot = (folder_.path() / "run.h5").string(),
                    cases = std::string(BSP2_SOURCE_DIR) + "/tests/cases/";
  const Ended saved = samples::run_command(BSP2_PROGRAM " run " + cases +
                                           "part-in-recess.csg --regions 16 --snapshot " + snapshot);
  ASSERT_EQ(saved.code, 0) << saved.text;
  const std::vector<std::pair<std::string, std::string>> meshes{
      {cases + "part-in-recess.csg", "a.vtu --type polyhedra"},
      {cases + "nonconforming.csg", "a.vtu --type polyhedra"},
      {cases + "curved-pipe-cross.csg", "a.vtu --type polyhedra --curved --tolerance 0.05"},
      {cases + "curved-pipe-cross.csg", "a.msh --curved --tolerance 0.1 --size 0"},
      {snapshot, "a.vtu --type polyhedra"},
      {model_.string(), "a --size 0.7"}};
  for (const auto& [model, options] : meshes) {
    std::string one;
    for (int ranks = 1; ranks <= 4; ++ranks) {
      const fs::path folder = folder_.path() / "of_ranks";
      fs::remove_all(folder);
      fs::create_directories(folder);
      const Ended ended = samples::run_command(BSP2_MPIEXEC " --oversubscribe -n " + std::to_string(ranks) +
                                               " " BSP2_PROGRAM " mesh " + model + " --threads 1 -o " +
                                               (folder / options).string());
      ASSERT_EQ(ended.code, 0) << ended.text;
      std::vector<fs::path> files;
      for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files.push_back(entry.path());
      std::sort(files.begin(), files.end());
      std::string all;
      for (const fs::path& file : files) all += file.string() + '\n' + content_of(file);
      if (ranks == 1) one = all;
      ASSERT_GT(all.size(), 100U);
      EXPECT_TRUE(all == one) << model << " -o " << options << ": others on " << ranks << " ranks";
    }
  }
}
#endif

TEST_F(MeshProgram, PlaneModelsAreRefused) {
  std::ofstream(model_) << "square([1, 1]);\n";
  const Ended ended = run("a.msh");
  EXPECT_EQ(ended.code, 2) << ended.text;
  EXPECT_NE(ended.text.find("of dimension 3, not 2"), std::string::npos) << ended.text;
}

/// A file of version 2.2 as lines, of which some may be made wrong.
class CheckedMesh : public MeshProgram {
 protected:
  fs::path file_ = folder_.path() / "a.msh";

  Ended check(const std::string& options = "") {
    return mesh("--check " + file_.string() + " --report " + report_.string() + " " + options);
  }
  std::vector<std::string> lines() {
    std::vector<std::string> lines;
    std::istringstream text(content_of(file_));
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  Ended check_lines(const std::vector<std::string>& lines) {
    std::ofstream file(file_);
    for (const std::string& line : lines) file << line << '\n';
    file.close();
    return check();
  }
};

TEST_F(CheckedMesh, WhatIsWrittenIsValidAndHasTheSameFigures) {
  for (const char* options : {"", "--msh-version 2.2", "--element-order 2"}) {
    ASSERT_EQ(run("a.msh", std::string("--size 0.7 --group 'floor=z==min' ") + options).code, 0);
    const nlohmann::json made = report();
    const Ended ended = check("--stats");
    ASSERT_EQ(ended.code, 0) << ended.text;
    EXPECT_NE(ended.text.find("on the outside"), std::string::npos) << ended.text;
    const nlohmann::json read = report();
    for (const char* figure : {"type", "cells", "points", "faces", "outer_faces", "groups"})
      EXPECT_EQ(read.at(figure), made.at(figure)) << options << figure;
    for (const char* volume : {"a", "b"})
      EXPECT_NEAR(read.at("volumes").at(volume).get<double>(), made.at("volumes").at(volume).get<double>(),
                  1e-12);
    for (const char* shape : {"dihedral_angles", "aspect"})
      for (const auto& [name, figure] : made.at(shape).items()) {
        if (figure.is_array()) continue;
        EXPECT_NEAR(read.at(shape).at(name).get<double>(), figure.get<double>(), 1e-9) << name;
      }
    EXPECT_EQ(read.at("dihedral_angles").at("histogram"), made.at("dihedral_angles").at("histogram"));
  }
}

TEST_F(CheckedMesh, WhatIsWrongIsToldInOneSentence) {
  ASSERT_EQ(run("a.msh", "--size 0.7 --msh-version 2.2").code, 0);
  const std::vector<std::string> right = lines();
  const auto tetrahedra = report().at("cells").get<std::uint64_t>();
  ASSERT_GT(tetrahedra, 1U);
  const std::uint64_t seed = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937_64 random(seed);
  const std::size_t chosen = right.size() - 2 - static_cast<std::size_t>(random() % tetrahedra);
  std::istringstream words(right[chosen]);
  std::array<std::string, 9> word;  // number, type, two tags, corners
  for (std::string& each : word) words >> each;
  ASSERT_EQ(word[1], "4") << right[chosen];
  const auto with = [&](std::size_t i, const std::string& corner, std::size_t k, const std::string& other) {
    auto changed = word;
    changed[i] = corner;
    changed[k] = other;
    std::string line;
    for (const std::string& each : changed) line += each + " ";
    auto all = right;
    all[chosen] = line;
    return all;
  };
  struct {
    std::vector<std::string> lines;
    const char* words;
  } const wrong[] = {
      {with(5, word[6], 6, word[5]), "is no valid mesh: 1 tetrahedron is flat or turned over\n"},
      {with(5, word[6], 6, word[6]), "1 tetrahedron is flat or turned over"},
      {with(5, "123456", 6, word[6]), "names node 123456, which has not been told of"},
      {{right.begin(), right.begin() + static_cast<std::ptrdiff_t>(chosen)}, "cut off"}};
  for (const auto& [lines, text] : wrong) {
    const Ended ended = check_lines(lines);
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find(text), std::string::npos) << ended.text;
  }
  EXPECT_EQ(check_lines(right).code, 0);
}

TEST_F(CheckedMesh, OptionsThatMakeAMeshAreRefused) {
  EXPECT_EQ(check("--size 3").code, 2);
  EXPECT_EQ(check("-o b.msh").code, 2);
  const Ended ended = mesh("--check " + model_.string());
  EXPECT_EQ(ended.code, 2);
  EXPECT_NE(ended.text.find("end in .msh"), std::string::npos) << ended.text;
  EXPECT_NE(mesh(model_.string()).text.find("--output is required"), std::string::npos);
}

}  // namespace
}  // namespace bsp2::models
