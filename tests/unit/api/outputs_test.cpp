#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2 {
namespace {

namespace fs = std::filesystem;
using Paths = std::vector<fs::path>;

std::string text_in(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// Boxes at random, some of them holes, in two parts.
Expression random_solid(std::mt19937& random) {
  std::uniform_int_distribution<int> place(0, 8), size(1, 5);
  const auto box = [&] {
    const Vector at{place(random) / 2.0, place(random) / 2.0, place(random) / 2.0};
    return cuboid({size(random) / 2.0, size(random) / 2.0, size(random) / 2.0}).translate(at);
  };
  return (box() + box() + box() - box()).part("one") + cuboid({1, 1, 1}).translate({9, 0, 0}).part("two");
}

/// Sections evaluate the model once more, without a half of it: the snapshot stays that of the whole.
TEST(Outputs, SnapshotsAreOfTheModelWhateverIsDrawn) {
  const samples::TemporaryFolder folder;
  Options options{.threads = 1};
  options.snapshot = folder.path() / "s.h5";
  options.outputs.drawing = {{folder.path() / "a.svg"}, {.views = {"front"}, .sections = {"A=x:1"}}};
  const Result drawn = evaluate(cuboid({2, 3, 4}) - cuboid({1, 1, 1}), options);
  EXPECT_TRUE(fs::exists(folder.path() / "a.svg"));
  EXPECT_EQ(resume(folder.path() / "s.h5", {.threads = 1}).digest(), drawn.digest());
}

/// What needs cells where none are found, and meshes that make no sense, are told before anything is
/// computed.
TEST(Outputs, ThatCannotBeAreTold) {
  const auto expect_told = [](const Options& options, const std::string& text) {
    try {
      evaluate(cube(), options);
      ADD_FAILURE() << "nothing is told of: " << text;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  };
  Options cells;
  cells.outputs.cells = "a.pvtu";
  cells.measures_only = true;
  expect_told(cells, "measures_only");
  cells.measures_only = false;
  cells.surface_only = true;
  expect_told(cells, "surface_only");
  Options mesh;
  mesh.outputs.solver_mesh = {"a.msh", {.dual = true}};
  expect_told(mesh, "hold polyhedra");
  mesh.outputs.solver_mesh = {"a.msh", {.size = -1}};
  expect_told(mesh, "size is -1");
  Options film;
  film.outputs.picture = "a.apng";
  film.outputs.film = Film{.sweep = Film::Sweep{.axis = 3}};
  expect_told(film, "axis");
  Options field{.size_field = {{0, 0, 0, 1}}};
  field.snapshot = "a.h5";
  expect_told(field, "size_field");
}

/// What an evaluation writes on its way is what its result writes, and holds nothing then.
TEST(Outputs, AreWhatAResultWrites) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  const samples::TemporaryFolder folder;
  const auto at = [&](const std::string& name) { return folder.path() / name; };
  const Expression solid = random_solid(random);
  const View view{.width = 80, .height = 60, .shade = "part"};

  const Result held = evaluate(solid, {.threads = 1});
  for (const char* name : {"held.stl", "held.ply", "held.pvtu", "held.png"})
    held.write(at(name), {.view = view});

  Options options{.threads = 1};
  Outputs& outputs = options.outputs;
  outputs.cells = at("new/a.pvtu");
  outputs.surfaces = {at("a.stl"), at("a.ply")};
  outputs.picture = at("a.png");
  outputs.view = view;
  outputs.report = at("a.json");
  outputs.table = at("a.csv");
  options.outputs_only = true;
  std::vector<std::string> begun;
  std::vector<Phase> phases;
  options.progress = [&](const Progress& now) {
    if (now.begun <= begun.size()) return;
    begun.push_back(now.superstep);
    phases.push_back(now.phase);
  };
  const Result result = evaluate(solid, options);
  EXPECT_TRUE(std::is_sorted(phases.begin(), phases.end()));
  for (std::size_t i = 0; i < begun.size(); ++i)
    EXPECT_EQ(phases[i] == Phase::computation, begun[i] == "computation") << begun[i];
  EXPECT_EQ(phases.front(), Phase::preparation);
  EXPECT_EQ(phases.back(), Phase::completion);
  EXPECT_EQ(text_in(at("a.stl")), text_in(at("held.stl")));
  EXPECT_EQ(text_in(at("a.ply")), text_in(at("held.ply")));
  EXPECT_EQ(text_in(at("a.png")), text_in(at("held.png")));
  EXPECT_EQ(text_in(at("new/a_0.vtu")), text_in(at("held_0.vtu")));
  EXPECT_EQ(result.digest(), held.digest());
  EXPECT_FALSE(result.has_cells());
  EXPECT_EQ(result.cells().size(), 0U);
  EXPECT_THROW(result.write(at("late.pvtu")), Error);
  const Figures figures = result.figures();
  EXPECT_EQ(figures.written,
            (Paths{at("new/a.pvtu"), at("a.stl"), at("a.ply"), at("a.png"), at("a.json"), at("a.csv")}));
  for (const char* what : {"compilation", "computation", "writing a.pvtu", "writing a.png", "writing a.json"})
    EXPECT_EQ(std::count(begun.begin(), begun.end(), what) > 0, true) << what;

  options.outputs_only = false;
  const Result both = evaluate(solid, options);
  EXPECT_TRUE(both.has_cells());
  EXPECT_EQ(both.cells().size(), held.cells().size());
  EXPECT_EQ(text_in(at("a.stl")), text_in(at("held.stl")));
}

TEST(Outputs, ThatCannotBeWrittenEndAllBeforeTheWork) {
  const samples::TemporaryFolder folder;
  const auto message = [&](const auto& set) {
    Options options{.threads = 1};
    options.progress = [](const Progress& now) { ADD_FAILURE() << now.superstep; };
    set(options.outputs);
    try {
      evaluate(cube(1), options);
    } catch (const Error& error) {
      EXPECT_TRUE(error.is_users_mistake());
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const fs::path file = folder.path() / "a.png";
  EXPECT_NE(message([&](Outputs& outputs) { outputs.surfaces = {file}; }).find("must end in .3mf, .amf,"),
            std::string::npos);
  EXPECT_NE(message([&](Outputs& outputs) { outputs.cells = file; }).find("must end in .pvtu"),
            std::string::npos);
  EXPECT_NE(message([&](Outputs& outputs) { outputs.report = folder.path(); }).find("it is a directory"),
            std::string::npos);
  EXPECT_NE(message([&](Outputs& outputs) {
              outputs.picture = outputs.report = file;
            }).find("two outputs would be written to one file"),
            std::string::npos);
  EXPECT_NE(message([&](Outputs& outputs) {
              outputs.picture = file;
              outputs.view.shade = "pink";
            }).find("no shade 'pink'"),
            std::string::npos);
  EXPECT_NE(message([&](Outputs& outputs) {
              outputs.drawing = {{folder.path() / "a.svg"}, {.sheet = "A9"}};
            }).find("sheet"),
            std::string::npos);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

/// Who ends what only makes files gets none, and those that were there stay.
TEST(Outputs, AreNotWrittenWhenTheyAreEnded) {
  const samples::TemporaryFolder folder;
  std::vector<Expression> balls;  // whose surface takes some tenths of a second
  for (int i = 0; i < 80; ++i) {
    const int x = i % 5, y = i / 5 % 4, z = i / 20;
    balls.push_back(sphere(1, {.fn = 24}).translate({1.3 * x + 0.01 * i, 1.3 * y, 1.3 * z}));
  }
  Options whole{.threads = 1, .outputs_only = true};
  whole.snapshot = folder.path() / "s.h5";
  evaluate(unite(balls), whole);
  const auto expect_none = [&](const std::string& superstep, const fs::path& file, Outputs outputs) {
    std::ofstream(file) << "earlier";
    bool is_at_it = false;
    Options options{.threads = 1, .outputs = std::move(outputs), .outputs_only = true};
    options.steps = 0;
    options.progress = [&](const Progress& now) { is_at_it = is_at_it || now.superstep == superstep; };
    options.stop = [&] { return is_at_it; };
    const Result result = resume(*whole.snapshot, options);
    EXPECT_TRUE(result.is_interrupted()) << file;
    EXPECT_TRUE(result.figures().failed.empty()) << file;
    EXPECT_EQ(text_in(file), "earlier");
  };
  const fs::path picture = folder.path() / "a.png", surface = folder.path() / "a.stl";
  Outputs drawn, glued;
  drawn.picture = picture;
  drawn.view = {.width = 4000, .height = 4000};
  expect_none("rendering", picture, drawn);
  glued.surfaces = {surface};
  expect_none("resolution", surface, glued);
}

TEST(Outputs, AsPdfHaveNoTimeInThem) {
  const samples::TemporaryFolder folder;
  Options options{.threads = 1};
  options.outputs.drawing = {{folder.path() / "a.pdf"}, {.views = {"front"}, .date = "2000-01-01"}};
  evaluate(cube(), options);
  const std::string pdf = text_in(folder.path() / "a.pdf");
  EXPECT_TRUE(pdf.starts_with("%PDF"));
  EXPECT_EQ(pdf.find("/CreationDate"), std::string::npos);
}

TEST(Outputs, AnimationsAreThoseOfAResult) {
  const samples::TemporaryFolder folder;
  const fs::path of_result = folder.path() / "a.apng", of_run = folder.path() / "b.apng";
  const Expression solid = cuboid({3, 2, 1}) - cuboid({1, 1, 1}).translate({1, 0.5, 0.5});
  const Film film{.count = 3, .turns = true, .explode = {{0, 1}}};
  Options options{.threads = 1};
  options.outputs.picture = of_run;
  options.outputs.film = film;
  options.outputs.view = {.width = 40, .height = 30};
  evaluate(solid, options).animate(of_result, film, options.outputs.view);
  EXPECT_EQ(text_in(of_result), text_in(of_run));
  EXPECT_GT(fs::file_size(of_run), 500U);
  EXPECT_THROW(evaluate(square(1)).animate(of_result, film), Error);
  EXPECT_THROW(evaluate(solid).animate(of_result, {.count = 0}), Error);
}

/// The report says the same in another form, a snapshot what was known when it was written.
TEST(Figures, AreThoseOfReportAndSnapshot) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  const samples::TemporaryFolder folder;
  Options options{.threads = 1, .surface = true};
  options.snapshot = folder.path() / "a.h5";
  const Result result = evaluate(random_solid(random).measure("all"), options);
  const Figures figures = result.figures();
  const auto report = nlohmann::json::parse(result.report());
  EXPECT_EQ(figures.model, report["model"].get<std::string>());
  EXPECT_EQ(figures.primitives, report["primitives"]);
  EXPECT_EQ(figures.in_cells, report["cells"]["in"]);
  EXPECT_EQ(figures.in_volume, report["volume"]["in"].get<double>());
  EXPECT_EQ(figures.measures.centroid, report["centroid"].get<Vector>());
  EXPECT_EQ(figures.lower, report["bounds"][0].get<Vector>());
  EXPECT_EQ(figures.upper, report["bounds"][1].get<Vector>());
  EXPECT_EQ(figures.digest, report["digest"].get<std::string>());
  ASSERT_TRUE(figures.boundary);
  EXPECT_EQ(figures.boundary->triangles, report["boundary"]["triangles"]);
  EXPECT_EQ(figures.boundary->digest, report["surface_digest"].get<std::string>());
  ASSERT_EQ(figures.parts.size(), report["parts"].size());
  EXPECT_EQ(figures.parts.at(1).name, "two");
  ASSERT_EQ(figures.named_measures.size(), 1U);
  EXPECT_EQ(figures.named_measures[0].first, "all");
  ASSERT_EQ(figures.supersteps.size(), report["supersteps"].size());
  for (std::size_t i = 0; i < figures.supersteps.size(); ++i) {
    EXPECT_EQ(figures.supersteps[i].name, report["supersteps"][i]["name"].get<std::string>());
    EXPECT_EQ(figures.supersteps[i].cells,
              report["supersteps"][i]["cells"].get<std::vector<std::uint64_t>>());
  }
  const SnapshotInfo info = snapshot_info(*options.snapshot);
  EXPECT_TRUE(is_snapshot(*options.snapshot));
  EXPECT_TRUE(info.is_complete);
  EXPECT_EQ(info.undecided, 0U);
  EXPECT_EQ(info.digest, figures.digest);
  EXPECT_EQ(info.in_cells, figures.in_cells);
  EXPECT_EQ(info.regions, figures.regions);
  EXPECT_THROW(snapshot_info(folder.path() / "b.h5"), Error);
}

TEST(Figures, OfAMeshAreThoseOfItsFile) {
  const samples::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.msh", report = folder.path() / "check.json";
  Options options{.threads = 1};
  options.outputs.solver_mesh = {.file = file, .mesh = {.size = 1}};
  options.outputs_only = true;
  const Figures figures = evaluate(cuboid({3, 2, 2}), options).figures();
  ASSERT_TRUE(figures.solver_mesh);
  EXPECT_EQ(figures.written, Paths{file});
  const MeshCheck check = check_mesh(file);
  EXPECT_TRUE(check.faults.empty());
  EXPECT_EQ(check.figures.cells, figures.solver_mesh->cells);
  EXPECT_EQ(check.figures.points, figures.solver_mesh->points);
  EXPECT_NEAR(check.figures.volume, 12, 1e-9);
  check.write(report);
  EXPECT_EQ(nlohmann::json::parse(text_in(report))["solver_mesh"]["cells"], check.figures.cells);
}

/// The master reads the file, and the result knows of it.
TEST(Evaluation, OfAFileIsThatOfItsText) {
  const samples::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.csg";
  std::ofstream(file) << "difference() { cube(size = [3, 3, 3]); sphere(r = 2, $fn = 8); }\n";
  const Result of_file = evaluate(file, {.threads = 1}), of_text = evaluate(load(file), {.threads = 1});
  EXPECT_EQ(of_file.digest(), of_text.digest());
  EXPECT_EQ(of_file.figures().model, file.string());
  of_file.write(folder.path() / "again.csg");
  EXPECT_EQ(evaluate(folder.path() / "again.csg").digest(), of_text.digest());
  EXPECT_THROW(evaluate(folder.path() / "none.csg"), Error);
}

TEST(Formats, AreKnownByTheirEndings) {
  EXPECT_TRUE(file_format("a.STL").surface && !file_format("a.stl").outline && !file_format("a.stl").picture);
  EXPECT_TRUE(file_format("a.svg").outline && file_format("a.svg").picture && file_format("a.svg").drawing);
  EXPECT_TRUE(file_format("a.apng").animation && !file_format("a.apng").picture);
  EXPECT_TRUE(file_format("case").openfoam && file_format("case").polyhedra);
  EXPECT_TRUE(file_format("a.msh").solver_mesh && file_format("a.msh").second_order);
  EXPECT_NE(surface_format_table().find("\n.stl "), std::string::npos);
  EXPECT_THROW(check(DrawingOptions{.scale = "large"}), Error);
  EXPECT_THROW(check_group("nothing"), Error);
  EXPECT_THROW(check_animation("a.png"), Error);
}

TEST(Ranks, AloneDoWhatIsAsked) {
  int done = 0;
  Ranks().together([&] { ++done; });
  EXPECT_EQ(done, 1);
  EXPECT_THROW(Ranks().together([] { throw Error("no"); }), Error);
}

}  // namespace
}  // namespace bsp2
