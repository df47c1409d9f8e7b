#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <thread>

#include "bsp2/bsp2.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2 {
namespace {

namespace fs = std::filesystem;

const std::string examples = BSP2_SOURCE_DIR "/examples/";

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// What the program finds.
std::string program_digest(const fs::path& model, const fs::path& folder, const std::string& options) {
  const std::string command = std::string(BSP2_PROGRAM) + " run '" + model.string() + "' --quiet --report '" +
                              (folder / "report.json").string() + "' " + options + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  const std::string report = read(folder / "report.json"), key = "\"digest\": \"";
  const std::size_t at = report.find(key);
  return at == std::string::npos
             ? "none"
             : report.substr(at + key.size(), report.find('"', at + key.size()) - at - key.size());
}

TEST(ApiResult, IsThatOfTheProgram) {
  const samples::TemporaryFolder folder;
  for (const char* model : {"every_node.csg", "menger_sponge.csg", "plane.csg", "expressions/product.csg"})
    EXPECT_EQ(evaluate(load(examples + model)).digest(), program_digest(examples + model, folder.path(), ""))
        << model;
  EXPECT_EQ(evaluate(load(examples + "napkin_ring.csg"), {.tolerance = 0.1, .curved = true}).digest(),
            program_digest(examples + "napkin_ring.csg", folder.path(), "--curved --tolerance 0.1"));
  const Expression block = cube(2) - cylinder(3, 0.5, false, {.fn = 30}).translate({1, 1, -0.5});
  std::ofstream(folder.path() / "block.csg") << block.to_text();
  EXPECT_EQ(evaluate(block).digest(), program_digest(folder.path() / "block.csg", folder.path(), ""));
}

TEST(ApiResult, HasCellsAsFlatArrays) {
  const Result result = evaluate(cube(2) - cube(1) + cube().translate({5, 0, 0}).part("far"));
  const Cells& cells = result.cells();
  ASSERT_EQ(cells.points.size(), 3 * cells.point_offset.back());
  ASSERT_EQ(cells.face_offset.size(), cells.size() + 1);
  ASSERT_EQ(cells.face_vertex_offset.size(), cells.face_offset.back() + 1);
  double volume = 0;
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    EXPECT_EQ(cells.labels[cell], label::in);
    volume += cells.volumes[cell];
    // By the divergence theorem from the faces.
    double by_faces = 0;
    const double* points = cells.points.data() + 3 * cells.point_offset[cell];
    for (std::uint32_t face = cells.face_offset[cell]; face < cells.face_offset[cell + 1]; ++face) {
      const auto corners =
          cells.face_vertices.subspan(cells.face_vertex_offset[face],
                                      cells.face_vertex_offset[face + 1] - cells.face_vertex_offset[face]);
      for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        const double *a = points + 3 * corners[0], *b = points + 3 * corners[i],
                     *c = points + 3 * corners[i + 1];
        by_faces += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                    a[2] * (b[0] * c[1] - b[1] * c[0]);
      }
    }
    EXPECT_NEAR(by_faces / 6, cells.volumes[cell], 1e-12);
  }
  EXPECT_NEAR(volume, 8, 1e-12);
  EXPECT_EQ(result.volume().least, result.volume().most);
  ASSERT_EQ(result.parts().size(), 1U);
  EXPECT_EQ(result.parts().front().name, "far");
  EXPECT_NEAR(result.parts().front().volume, 1, 1e-12);
}

TEST(ApiResult, EnclosesWhatIsRound) {
  const Result result = evaluate(ball(3, 1).measure("b"), {.tolerance = 0.05});
  const double truth = 4 * std::numbers::pi / 3;
  EXPECT_LT(result.volume().least, truth);
  EXPECT_GT(result.volume().most, truth);
  const Measures named = result.named_measures().at("b");
  EXPECT_LT(named.volume.least, truth);
  EXPECT_GT(named.volume.most, truth);
}

TEST(ApiResult, FindsSurfaceAndContactsLater) {
  const Expression solid = cube(2) - cube(1).translate({0.5, 0.5, 0.5}) + cube().translate({2, 0, 0});
  const Result early = evaluate(solid, {.surface = true, .contacts = true}), late = evaluate(solid),
               without = evaluate(solid, {.surface_only = true});
  const Surface surface = late.surface();
  EXPECT_TRUE(surface.closed);
  EXPECT_EQ(surface.digest, early.surface().digest);
  EXPECT_EQ(surface.digest, without.surface().digest);
  EXPECT_NEAR(surface.area, 6 * 4 + 6 + 4, 1e-9);
  EXPECT_EQ(surface.parts.size() * 3, surface.triangles.size());
  const auto a = early.contacts(), b = late.contacts();
  ASSERT_EQ(a.size(), b.size());
  EXPECT_GT(a.size(), 0U);
  (void)late.cells();  // now they are held otherwise
  EXPECT_EQ(late.contacts().size(), a.size());
  EXPECT_FALSE(without.has_cells());
}

/// A block with a cavity, and a part that stands on it: volumes by formula, and by the faces themselves.
TEST(ApiResult, HasFacesEdgesAndSolidsAsFlatArrays) {
  const Expression solid = (cube(4) - cube(1).translate({1, 1, 1})).part("block") +
                           cube(1).translate({1, 1, 4}).part("knob") +
                           cube(1).translate({9, 0, 0}).part("far");
  for (const Options& options : {Options{}, Options{.surface_only = true, .faces = true}}) {
    const Brep faces = evaluate(solid, options).faces();
    EXPECT_TRUE(faces.closed);
    const std::size_t f = faces.offsets.size(), e = faces.edges.size() / 2, l = faces.use_offset.size() - 1;
    EXPECT_EQ(f, 6U + 6 + 6 + 6) << "the side on which the knob stands has a hole, which is a face";
    EXPECT_EQ(l, f + 1);
    EXPECT_EQ(e, 4 * 12U);
    EXPECT_EQ(faces.points.size(), 3 * 4 * 8U);
    EXPECT_EQ(faces.solid_parts.size(), 3U);
    EXPECT_EQ(faces.shell_volumes.size(), 4U);
    std::vector<double> volumes = faces.solid_volumes;
    std::sort(volumes.begin(), volumes.end());
    EXPECT_NEAR(volumes[0], 1, 1e-12);
    EXPECT_NEAR(volumes[1], 1, 1e-12);
    EXPECT_NEAR(volumes[2], 63, 1e-12);
    // Each loop goes through its points and comes back; each use is once around its edge.
    for (std::size_t loop = 0; loop < l; ++loop) {
      const auto from = [&](std::uint32_t use) {
        return faces.edges[2 * faces.uses[use] + (faces.forward[use] ? 0 : 1)];
      };
      const auto to = [&](std::uint32_t use) {
        return faces.edges[2 * faces.uses[use] + (faces.forward[use] ? 1 : 0)];
      };
      const std::uint32_t begin = faces.use_offset[loop], end = faces.use_offset[loop + 1];
      for (std::uint32_t use = begin; use < end; ++use)
        EXPECT_EQ(to(use), from(use + 1 < end ? use + 1 : begin));
    }
    for (std::size_t edge = 0; edge < e; ++edge) {
      double turn = 0;
      for (std::uint32_t i = faces.around_offset[edge]; i < faces.around_offset[edge + 1]; ++i) {
        EXPECT_EQ(faces.uses[faces.around[i]], edge);
        turn += faces.angles[faces.around[i]];
      }
      EXPECT_NEAR(turn, 2 * std::numbers::pi, 1e-9);
    }
    const auto interfaces = [&](std::size_t face) { return faces.parts[2 * face + 1] != Brep::outside; };
    std::size_t count = 0;
    for (std::size_t face = 0; face < f; ++face) count += interfaces(face) ? 1 : 0;
    EXPECT_EQ(count, 1U);
    EXPECT_EQ(faces.sides.size(), f + count);
    // By the divergence theorem, from the triangles of each face.
    double volume = 0;
    for (std::size_t t = 0; t < faces.triangle_faces.size(); ++t) {
      if (interfaces(faces.triangle_faces[t])) continue;
      const auto p = [&](std::size_t k) { return &faces.points[3 * faces.triangles[3 * t + k]]; };
      const double *a = p(0), *b = p(1), *c = p(2);
      volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                 a[2] * (b[0] * c[1] - b[1] * c[0])) /
                6;
    }
    EXPECT_NEAR(volume, 65, 1e-9);
  }
  EXPECT_THROW((void)evaluate(square(1)).faces(), Error);
}

TEST(ApiResult, WritesEachFormat) {
  const samples::TemporaryFolder folder;
  const fs::path base = folder.path() / "new" / "x";
  const Result result = evaluate(cube() - cube(0.5), {.snapshot = folder.path() / "s.h5"});
  for (const char* ending : {".pvtu", ".stl", ".ply", ".obj", ".vtp", ".3mf", ".glb", ".step", ".iges",
                             ".brep", ".png", ".svg", ".json", ".csg", ".h5"}) {
    result.write(base.string() + ending);
    EXPECT_GT(fs::file_size(base.string() + ending), 50U) << ending;
  }
  EXPECT_EQ(result.picture("png"), read(base.string() + ".png"));
  EXPECT_NE(result.picture("svg", {.edges = "feature"}), result.picture("svg"));
  EXPECT_NE(result.picture("png", {.shade = "level"}),
            result.picture("png", {.shade = "level", .legend = false, .axes = true}));
  EXPECT_THROW(static_cast<void>(result.picture("png", {.edges = "sharp"})), Error);
  EXPECT_EQ(read(base.string() + ".csg"), (cube() - cube(0.5)).to_text());
  EXPECT_THROW(result.write(base.string() + ".xyz"), Error);
  EXPECT_FALSE(fs::exists(base.string() + ".xyz"));
}

/// As the program does.
TEST(ApiResult, WritesCirclesOfPlaneModelsAsArcs) {
  const samples::TemporaryFolder folder;
  const fs::path drawing = folder.path() / "x.dxf";
  const Result result = evaluate(ball(2, 3) - ball(2, 1.25));
  result.write(drawing);
  const std::string text = read(drawing);
  EXPECT_NE(text.find("AcDbCircle\n10\n0\n20\n0\n40\n3\n"), std::string::npos);
  EXPECT_NE(text.find("AcDbCircle\n10\n0\n20\n0\n40\n1.25\n"), std::string::npos);
  EXPECT_EQ(text.find("LWPOLYLINE"), std::string::npos);
}

TEST(ApiResult, KeepsTheSurfaceThatIsLookedAt) {
  const samples::TemporaryFolder folder;
  const Result result = evaluate(cube(2) - cube(1));
  const Surface surface = result.surface();
  const std::vector<double> points(surface.points.begin(), surface.points.end());
  result.write(folder.path() / "x.brep");  // has the faces found
  EXPECT_EQ(result.surface().points.data(), surface.points.data());
  EXPECT_TRUE(std::equal(points.begin(), points.end(), surface.points.begin()));
  const Result skin = evaluate(cube(), {.surface_only = true});
  try {
    skin.write(folder.path() / "y.brep");
    ADD_FAILURE() << "it has no faces";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("'faces'"), std::string::npos) << error.what();
  }
}

TEST(ApiResult, WritesNoFileOfWhatItDoesNotHold) {
  const samples::TemporaryFolder folder;
  const Result figures = evaluate(cube(), {.measures_only = true}),
               skin = evaluate(cube(), {.surface_only = true});
  for (const Result* result : {&figures, &skin})
    for (const char* name : {"x.pvtu", "x.png"}) {
      EXPECT_THROW(result->write(folder.path() / name), Error) << name;
      EXPECT_FALSE(fs::exists(folder.path() / name)) << name;
    }
  EXPECT_THROW(figures.write(folder.path() / "x.stl"), Error);
  EXPECT_THROW(figures.write(folder.path() / "x.h5"), Error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  skin.write(folder.path() / "x.stl");
  EXPECT_EQ(figures.volume().least, 1);
}

TEST(ApiResult, GoesOnFromASnapshot) {
  const samples::TemporaryFolder folder;
  const fs::path snapshot = folder.path() / "s.h5";
  Expression solid = cube(4);
  for (int i = 0; i < 20; ++i) solid -= sphere(0.5, {.fn = 24}).translate({0.2 * i, 0.15 * i, 0.1 * i});
  const std::string digest = evaluate(solid, {.regions = 8}).digest();
  const Result first = evaluate(solid, {.regions = 8, .cells = 40, .snapshot = snapshot});
  EXPECT_FALSE(first.is_complete());
  EXPECT_NE(first.digest(), digest);
  const Result rest = resume(snapshot);
  EXPECT_TRUE(rest.is_complete());
  EXPECT_EQ(rest.digest(), digest);
  rest.write(folder.path() / "m.csg");
  EXPECT_EQ(read(folder.path() / "m.csg"), solid.to_text());
  EXPECT_THROW(resume(folder.path() / "none.h5"), Error);
}

TEST(ApiResult, GoesOnWithWhatASnapshotKeeps) {
  const samples::TemporaryFolder folder;
  const fs::path snapshot = folder.path() / "s.h5";
  evaluate(cube(), {.keep_in = false, .keep_out = true, .snapshot = snapshot});
  const Result rest = resume(snapshot);
  EXPECT_THROW((void)rest.surface(), Error);
  EXPECT_THROW((void)rest.locate(std::vector<double>{0.5, 0.5, 0.5}), Error);
  evaluate(cube(), {.snapshot = snapshot});
  const Result all = resume(snapshot, {.keep_in = false, .keep_out = true});  // the snapshot's own counts
  EXPECT_EQ(all.locate(std::vector<double>{0.5, 0.5, 0.5}).labels.front(), label::in);
  EXPECT_NEAR(all.surface().area, 6, 1e-12);
}

TEST(ApiResult, EndsWhenAsked) {
  std::atomic<bool> has_computed = false;
  const Result result = evaluate(
      ball(4, 1),
      {.tolerance = 1e-3,
       .progress =
           [&](const Progress& now) { has_computed = has_computed || now.superstep == "computation"; },
       .stop = [&] { return has_computed.load(); }});
  EXPECT_TRUE(result.is_interrupted());
  EXPECT_FALSE(result.is_complete());
  EXPECT_EQ(result.cells().size(), 0U);
  EXPECT_THROW((void)result.surface(), Error);
  EXPECT_THROW((void)result.locate(std::vector<double>(4)), Error);
}

TEST(ApiResult, KeepsCellsWhoseSurfaceIsNotWaitedFor) {
  std::vector<Expression>
      balls;  // whose surface takes some tenths of a second: who ends it is asked now and then
  for (int i = 0; i < 80; ++i) {
    const int layer = i / 20;
    balls.push_back(
        sphere(1, {.fn = 24}).translate({1.3 * (i % 5) + 0.01 * i, 1.3 * (i / 5 % 4), 1.3 * layer}));
  }
  const Expression model = unite(balls);
  std::atomic<bool> is_looked_for = false;
  const Result result = evaluate(model, {.surface = true,
                                         .progress =
                                             [&](const Progress& now) {
                                               is_looked_for = is_looked_for || now.superstep == "resolution";
                                             },
                                         .stop = [&] { return is_looked_for.load(); }});
  EXPECT_FALSE(result.is_interrupted());
  EXPECT_NE(result.report().find("interrupted"), std::string::npos);
  EXPECT_EQ(result.digest(), evaluate(model).digest());
  EXPECT_EQ(result.surface().digest, evaluate(model, {.surface = true}).surface().digest);
}

TEST(ApiResult, EndsWhateverIsAskedOfItAndCanBeAskedAgain) {
  const Expression model = parse("difference() { cube(4); sphere(2, $fn = 8); }");
  const Result result = evaluate(model);
  const auto is_ended = [](const auto& ask) {
    const Stoppable stoppable([] { return true; });
    try {
      ask();
    } catch (const Error& error) {
      EXPECT_STREQ(error.what(), "interrupted");
      return true;
    }
    return false;
  };
  EXPECT_TRUE(is_ended([] { (void)parse("cube(1);"); }));
  EXPECT_TRUE(is_ended([&] { (void)result.surface(); }));
  EXPECT_TRUE(is_ended([&] { (void)result.contacts(); }));
  EXPECT_TRUE(is_ended([&] { (void)result.solver_mesh({.size = 4}); }));
  EXPECT_FALSE(is_ended([&] { EXPECT_TRUE(evaluate(model).is_interrupted()); }));
  EXPECT_FALSE(is_ended([&] { (void)result.cells(); }));
  const Result untouched = evaluate(model, {.surface = true});
  EXPECT_EQ(result.surface().digest, untouched.surface().digest);
  EXPECT_EQ(result.contacts().size(), untouched.contacts().size());
  EXPECT_EQ(result.solver_mesh({.size = 4}).tetrahedra().size(),
            untouched.solver_mesh({.size = 4}).tetrahedra().size());
  // Within the compilation: what a construct is made of is evaluated there.
  bool has_begun = false;
  const Result none =
      evaluate(parse("minkowski() { difference() { cube(4); sphere(1, $fn = 30); } sphere(1, $fn = 30); }"),
               {.stop = [&] { return std::exchange(has_begun, true); }});
  EXPECT_TRUE(none.is_interrupted());
}

TEST(ApiResult, EndsFilesForCadPrograms) {
  const samples::TemporaryFolder folder;
  const Result result = evaluate(parse("difference() { cube(4); sphere(2, $fn = 8); }"), {.surface = true});
  const auto is_ended = [](const auto& work) {
    const Stoppable stoppable([] { return true; });
    try {
      work();
    } catch (const Error& error) {
      return std::string(error.what()) == "interrupted";
    }
    return false;
  };
  for (const char* ending : {".step", ".iges", ".brep"}) {
    const fs::path file = folder.path() / (std::string("part") + ending);
    EXPECT_TRUE(is_ended([&] { result.write(file); })) << ending;
    EXPECT_FALSE(fs::exists(file)) << ending;
    EXPECT_NO_THROW(result.write(file)) << ending;
    EXPECT_TRUE(fs::exists(file)) << ending;
  }
}

TEST(ApiResult, ManyThreadsEvaluateAtOnce) {
  const Expression shared = cube(3) - sphere(1.5, {.fn = 20});
  const std::string digest = evaluate(shared).digest();
  std::vector<std::thread> threads;
  std::atomic<int> same = 0;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      if (evaluate(shared + Expression(), {.threads = 2}).digest() == digest) ++same;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(same, 4);
}

TEST(ApiResult, ManyThreadsWriteSnapshotsAtOnce) {
  const samples::TemporaryFolder folder;
  const Expression solid = cube(3) - sphere(1.5, {.fn = 8});
  const std::string digest = evaluate(solid).digest();
  std::vector<std::thread> threads;
  std::atomic<int> same = 0;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      const fs::path snapshot = folder.path() / (std::to_string(i) + ".h5");
      for (int round = 0; round < 5; ++round) {
        const Result result = evaluate(solid, {.threads = 1, .snapshot = snapshot});
        if (result.warnings().empty() && resume(snapshot, {.threads = 1}).digest() == digest) ++same;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(same, 20);
}

TEST(ApiResult, TellsWarningsOrThrowsThem) {
  const Expression empty = cube() & cube().translate({5, 0, 0});
  const auto warnings = evaluate(empty).warnings();
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings.front().find("empty"), std::string::npos);
  EXPECT_THROW(evaluate(empty, {.strict = true}), Error);
  EXPECT_TRUE(evaluate(empty).bounds().first.empty());
  EXPECT_EQ(evaluate(empty).cells().size(), 0U);
}

}  // namespace
}  // namespace bsp2
