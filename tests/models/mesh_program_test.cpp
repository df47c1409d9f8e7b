// `bsp2 mesh` from the model to the file: what each file says of the mesh, read back as text.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;

struct MeshEnded {
  int code;
  std::string text;  // standard output and standard error
};

MeshEnded mesh(const std::string& arguments) {
  FILE* pipe = popen((BSP2_PROGRAM " mesh " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), count);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text};
}

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
  MeshEnded run(const std::string& file, const std::string& options = "") {
    return mesh(model_.string() + " -o " + (folder_.path() / file).string() + " --report " +
                report_.string() + " " + options);
  }
};

TEST_F(MeshProgram, FilesHoldVolumesAndGroups) {
  const MeshEnded ended = run("a.msh", "--size 0.7 --group 'floor=z==min'");
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

TEST_F(MeshProgram, OpenFoamCasesHavePatchesAndZones) {
  const MeshEnded ended = run("case");
  ASSERT_EQ(ended.code, 0) << ended.text;
  const fs::path mesh = folder_.path() / "case" / "constant" / "polyMesh";
  for (const char* file : {"points", "faces", "owner", "neighbour"})
    EXPECT_TRUE(fs::exists(mesh / file)) << file;
  EXPECT_NE(content_of(mesh / "boundary").find("a_outside"), std::string::npos);
  EXPECT_NE(content_of(mesh / "cellZones").find("cellZone"), std::string::npos);
  EXPECT_NE(content_of(mesh / "faceZones").find("a_b"), std::string::npos);
  EXPECT_NEAR(report().at("volume").get<double>(), 5, 1e-9);
}

TEST_F(MeshProgram, SizesAreReadFromATable) {
  const fs::path table = folder_.path() / "sizes.csv";
  std::ofstream(table) << "x,y,z,size\n0, 0, 0, 0.2  # fine\n\n2 2 0\t0.8\n";
  ASSERT_EQ(run("a.msh", "--size-field " + table.string()).code, 0);
  const auto points = report().at("points").get<int>();
  EXPECT_EQ(report().at("size").get<double>(), 0.8);
  ASSERT_EQ(run("a.msh", "--size-field " + table.string() + " --growth 0.2").code, 0);
  EXPECT_GT(report().at("points").get<int>(), points);
  for (const char* wrong : {"1 2 3 0\n", "0 0 0 1\n1 2 3\n", "0 0 0 1\n1 2 3 4 5\n", "x y z\n"}) {
    std::ofstream(table) << wrong;
    const MeshEnded ended = run("a.msh", "--size-field " + table.string());
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find("sizes.csv:"), std::string::npos) << ended.text;
  }
}

TEST_F(MeshProgram, MistakesAreToldInOneMessage) {
  const std::array<std::array<const char*, 3>, 5> wrong{{{"a.xyz", "", "must end in"},
                                                         {"a.inp", "--type polyhedra", "hold polyhedra"},
                                                         {"case", "--element-order 2", "--element-order 2"},
                                                         {"a.msh", "--part-size c=1", "has no part 'c'"},
                                                         {"a.msh", "--group q", "NAME=PREDICATE"}}};
  for (const auto& [file, options, words] : wrong) {
    const MeshEnded ended = run(file, options);
    EXPECT_EQ(ended.code, 2) << ended.text;
    EXPECT_NE(ended.text.find(words), std::string::npos) << ended.text;
  }
}

TEST_F(MeshProgram, PlaneModelsAreRefused) {
  std::ofstream(model_) << "square([1, 1]);\n";
  const MeshEnded ended = run("a.msh");
  EXPECT_EQ(ended.code, 2) << ended.text;
  EXPECT_NE(ended.text.find("of dimension 3, not 2"), std::string::npos) << ended.text;
}

}  // namespace
}  // namespace bsp2::models
