// The surface in a snapshot: that which would be found again, and only where it belongs to the cells.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "bsp2/io/outputs/snapshot.hpp"
#include "models.hpp"
#include "support/command.hpp"
#include "support/random_text.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;
using supersteps::RunOptions;
using supersteps::RunResult;

void expect_same(const geometry::TriangleSurface& a, const geometry::TriangleSurface& b) {
  EXPECT_TRUE(a.points == b.points);
  EXPECT_TRUE(a.triangles == b.triangles);
  EXPECT_TRUE(a.owner == b.owner);
}

/// The rows of a table, member by member.
template <typename Row, typename... Members>
void expect_same_rows(const std::vector<Row>& a, const std::vector<Row>& b, Members... members) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(((a[i].*members == b[i].*members) && ...)) << i;
}

void expect_same(const geometry::Brep& a, const geometry::Brep& b) {
  using B = geometry::Brep;
  EXPECT_TRUE(a.points == b.points);
  expect_same_rows(a.edges, b.edges, &B::Edge::ends, &B::Edge::first, &B::Edge::count);
  expect_same_rows(a.faces, b.faces, &B::Face::normal, &B::Face::offset, &B::Face::part, &B::Face::other,
                   &B::Face::first_loop, &B::Face::loops);
  expect_same_rows(a.loops, b.loops, &B::Loop::first_use, &B::Loop::uses);
  expect_same_rows(a.uses, b.uses, &B::Use::edge, &B::Use::face, &B::Use::forward, &B::Use::angle);
  EXPECT_TRUE(a.uses_of_edges == b.uses_of_edges);
  expect_same_rows(a.shells, b.shells, &B::Shell::part, &B::Shell::solid, &B::Shell::first, &B::Shell::count,
                   &B::Shell::is_cavity, &B::Shell::volume);
  expect_same_rows(a.faces_of_shells, b.faces_of_shells, &B::Side::face, &B::Side::is_front);
  expect_same_rows(a.solids, b.solids, &B::Solid::part, &B::Solid::first_shell, &B::Solid::shells,
                   &B::Solid::volume);
  EXPECT_TRUE(a.triangles == b.triangles);
  EXPECT_TRUE(a.face_of_triangle == b.face_of_triangle);
  EXPECT_EQ(a.is_closed, b.is_closed);
}

class KeptSurface : public testing::Test {
 protected:
  samples::TemporaryFolder folder_;
  fs::path model_ = folder_.path() / "model.csg";

  [[nodiscard]] fs::path file(const char* name) const { return folder_.path() / name; }
  void write(const std::string& text) const { std::ofstream(model_) << text; }
  [[nodiscard]] RunOptions of_model(const fs::path& snapshot) const {
    RunOptions options;
    options.model = model_;
    options.threads = 2;
    options.snapshot = snapshot;
    return options;
  }
  /// What is asked of a snapshot as it is.
  static RunOptions of_snapshot(const fs::path& snapshot) {
    RunOptions options;
    options.resume = snapshot;
    options.steps = 0;
    options.threads = 1;
    options.boundary = true;
    return options;
  }
};

/// Two random solids of two colours.
std::string coloured(samples::RandomText& random, double curved) {
  return "color([1,0,0]) { " + random.model(3, 2, curved) + " }\ncolor([0,0,1]) { " +
         random.model(3, 1, curved) + " }\n";
}

TEST_F(KeptSurface, IsThatWhichWouldBeFoundAgain) {
  const auto seed = samples::new_seed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  samples::RandomText random(seed);
  for (int round = samples::rounds(40); round > 0; --round) {
    SCOPED_TRACE(round);
    RunOptions options = of_model(file("plain.h5"));
    const bool is_curved = random.chance(0.3);
    options.curved = is_curved;
    if (is_curved) options.tolerance = 0.5;
    options.parts_by_colour = random.chance(0.5);
    if (random.chance(0.3)) options.level = static_cast<unsigned>(random.pick(2, 12));
    write(coloured(random, is_curved ? 0.5 : 0));
    supersteps::run(options);
    options.snapshot = file("kept.h5");
    options.boundary = options.faces = true;
    options.traces_boundary = random.chance(0.5);
    options.strict = random.chance(0.1) && !is_curved;
    RunResult first;
    try {
      first = supersteps::run(options);
    } catch (const Error& error) {  // strictly, a solid without an IN cell
      const std::string why = error.what();
      ASSERT_TRUE(options.strict &&
                  (why.find("is empty") != std::string::npos || why.find("no cell is IN") == 0))
          << why;
      continue;
    }
    ASSERT_EQ(io::read_surface(file("kept.h5"), 2, true).has_value(), first.report.complete);
    RunOptions again = of_snapshot(file("plain.h5"));
    again.faces = true;
    const RunResult found = supersteps::run(again);
    again.resume = file("kept.h5");
    const RunResult kept = supersteps::run(again);
    again.surface_only = true;
    const RunResult alone = supersteps::run(again);
    for (const RunResult* result : std::initializer_list<const RunResult*>{&first, &kept, &alone}) {
      ASSERT_TRUE(result->boundary && result->faces && found.boundary && found.faces);
      expect_same(*result->boundary, *found.boundary);
      expect_same(*result->faces, *found.faces);
      EXPECT_EQ(result->report.boundary->digest, found.report.boundary->digest);
      EXPECT_EQ(result->report.digest, found.report.digest);
      EXPECT_EQ(result->report.in_volume, found.report.in_volume);
    }
    EXPECT_EQ(kept.mesh.batches.empty(), found.mesh.batches.empty());
  }
}

/// Another surface in the snapshot's place tells whether it is taken from there.
TEST_F(KeptSurface, IsTakenOnlyWhereItIsThatOfTheCells) {
  write("difference() { cube(4); sphere(r = 2, $fn = 12); }");
  RunOptions options = of_model(file("run.h5"));
  options.level = 12;
  options.boundary = true;
  ASSERT_TRUE(supersteps::run(options).report.complete);
  const geometry::TriangleSurface other{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                        {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
                                        {0, 0, 0, 0}};
  io::add_surface(file("run.h5"), other, nullptr);
  const auto triangles = [&](const RunOptions& asked) {
    return supersteps::run(asked).report.boundary->triangles;
  };
  RunOptions asked = of_snapshot(file("run.h5"));
  EXPECT_EQ(triangles(asked), 4U);
  asked.faces = true;  // which are not there
  EXPECT_GT(triangles(asked), 4U);
  asked.faces = false;
  asked.contacts = true;
  EXPECT_GT(triangles(asked), 4U);
  asked.contacts = false;
  asked.level = 20;
  EXPECT_GT(triangles(asked), 4U);
  // Who goes on, and is not asked for a surface, leaves none.
  RunOptions going_on;
  going_on.resume = going_on.snapshot = file("run.h5");
  going_on.level = 20;
  EXPECT_TRUE(supersteps::run(going_on).report.complete);
  EXPECT_FALSE(io::read_surface(file("run.h5"), 2, false));
  going_on.boundary = true;
  EXPECT_TRUE(supersteps::run(going_on).report.complete);
  EXPECT_TRUE(io::read_surface(file("run.h5"), 2, false));
}

TEST_F(KeptSurface, IsNotThereBeforeAllIsDecided) {
  model_ = fs::path(BSP2_SOURCE_DIR) / "examples" / "leaning_tower.csg";
  RunOptions options = of_model(file("run.h5"));
  options.boundary = true;
  options.budget_seconds = 0.001;
  options.steps = 1;
  ASSERT_FALSE(supersteps::run(options).report.complete);
  EXPECT_FALSE(io::read_surface(file("run.h5"), 2, false));
}

/// Files of all kinds, byte for byte, on any number of ranks.
TEST_F(KeptSurface, GivesTheFilesThatWouldBeWrittenWithoutIt) {
  write(
      "color([1,0,0]) { difference() { cube(4); sphere(r = 2, $fn = 12); } }\n"
      "color([0,0,1]) { multmatrix([[1,0,0,4],[0,1,0,0.5],[0,0,1,0.25],[0,0,0,1]]) { cube(3); } }\n");
  const std::string program = BSP2_PROGRAM, model = model_.string() + " --parts colour --quiet";
  std::vector<std::string> launchers{""};
#ifdef BSP2_MPIEXEC
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  launchers.push_back(std::string(BSP2_MPIEXEC) + " --oversubscribe -n 2 ");
#endif
  const auto bytes = [](const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  samples::printed(program + " run " + model + " --snapshot " + file("plain.h5").string());
  for (const std::string& launcher : launchers) {
    samples::printed(launcher + program + " run " + model + " --snapshot " + file("kept.h5").string() +
                     " --boundary " + file("first.step").string());
    EXPECT_NE(samples::printed(program + " info " + file("kept.h5").string()).find("with its faces"),
              std::string::npos);
    samples::printed(launcher + program + " run " + model + " --snapshot " + file("triangles.h5").string() +
                     " --boundary " + file("first.ply").string());
    EXPECT_NE(samples::printed(program + " info " + file("triangles.h5").string()).find("its triangles"),
              std::string::npos)
        << "faces that no file needs were found";
    for (const char* name : {"a.ply", "a.stl", "a.obj", "a.brep", "a.3mf", "a.amf"}) {
      for (const char* snapshot : {"plain", "kept", "triangles"})
        samples::printed(launcher + program + " export " + file(snapshot).string() + ".h5 -o " +
                         (folder_.path() / snapshot / name).string());
      const std::string plain = bytes(folder_.path() / "plain" / name);
      EXPECT_FALSE(plain.empty());
      EXPECT_TRUE(plain == bytes(folder_.path() / "kept" / name)) << name << " " << launcher;
      EXPECT_TRUE(plain == bytes(folder_.path() / "triangles" / name)) << name << " " << launcher;
    }
  }
}

}  // namespace
}  // namespace bsp2::models
