// A run on several ranks against the run of one process.
#include "bsp2/supersteps/loop/run.hpp"

#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPUnstructuredGridReader.h>

#include <fstream>
#include <numeric>
#include <random>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "bsp2/supersteps/stages/collection.hpp"
#include "ranks/exchange.hpp"
#include "support/random_text.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::supersteps {
namespace {

namespace fs = std::filesystem;

RunOptions options_for(const fs::path& model, unsigned regions, unsigned threads) {
  RunOptions options;
  options.model = model;
  options.regions = regions;
  options.threads = threads;
  options.collect_cells = false;
  options.move_after_seconds
      .reset();  // a step that ends early splits some cells again, and the splits are compared
  return options;
}

/// All that does not depend on who computed: bit for bit.
void expect_same_solid(const RunReport& a, const RunReport& b) {
  EXPECT_EQ(a.digest, b.digest);
  EXPECT_EQ(a.in_cells, b.in_cells);
  EXPECT_EQ(a.fuzzy_cells, b.fuzzy_cells);
  EXPECT_EQ(a.out_cells, b.out_cells);
  EXPECT_EQ(a.in_volume, b.in_volume);
  EXPECT_EQ(a.fuzzy_volume, b.fuzzy_volume);
  EXPECT_EQ(a.centroid, b.centroid);
  EXPECT_EQ(a.inertia, b.inertia);
  EXPECT_EQ(a.lower, b.lower);
  EXPECT_EQ(a.upper, b.upper);
  EXPECT_EQ(a.level, b.level);
  EXPECT_EQ(a.regions, b.regions);
  EXPECT_EQ(a.primitives, b.primitives);
  EXPECT_EQ(a.hyperplanes, b.hyperplanes);
  EXPECT_EQ(a.splits, b.splits);
  EXPECT_EQ(a.predicates, b.predicates);
  EXPECT_EQ(a.warnings, b.warnings);
}

void compare(const RunOptions& options) {
  Ranks ranks = Ranks::launched();
  RunReport together;
  ranks.together([&] { together = run(options, ranks).report; });
  if (!ranks.is_master()) return;
  RunOptions alone = options;
  alone.threads = 3 - options.threads;  // 1 or 2
  const RunReport expected = run(alone).report;
  EXPECT_GT(expected.in_cells, 4U);
  EXPECT_EQ(together.ranks, static_cast<unsigned>(ranks.count()));
  expect_same_solid(together, expected);
  std::vector<std::string> names;
  for (const auto& record : together.supersteps) {
    names.push_back(record.name);
    EXPECT_EQ(record.seconds.size(), together.ranks);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"compilation", "broadcast", "distribution", "computation",
                                             "collection"}));
}

TEST(Run, FindsTheSameCellsOnAnyNumberOfRanks) {
  for (const char* name : {"constructs", "every_node", "mechanical_piece", "menger_sponge", "plane",
                           "polyhedra", "touching_solids"})
    for (const unsigned regions : {1U, 8U, 32U}) {
      SCOPED_TRACE(std::string(name) + ", regions " + std::to_string(regions));
      compare(options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / (std::string(name) + ".csg"), regions,
                          1 + regions % 2));
    }
}

/// Cuts between regions add no cell, change none, and what they parted as a whole is given back.
TEST(Run, FindsTheSameCellsInAnyNumberOfRegions) {
  Ranks ranks = Ranks::launched();
  for (const char* name :
       {"every_node", "mechanical_piece", "menger_sponge", "napkin_ring", "polyhedra", "touching_solids"})
    for (const unsigned level : {0U, 7U}) {  // 0: to the end
      SCOPED_TRACE(std::string(name) + ", level " + std::to_string(level));
      std::vector<std::string> digests;
      for (const unsigned regions : {1U, 2U, 16U, 128U}) {
        RunOptions options =
            options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / (std::string(name) + ".csg"), regions, 1);
        if (level > 0) options.level = level;
        options.keep_out = true;
        ranks.together([&] { digests.push_back(run(options, ranks).report.digest); });
      }
      if (ranks.is_master()) {
        EXPECT_EQ(digests, std::vector<std::string>(digests.size(), digests[0]));
      }
    }
}

/// Nor do they where solids are round: random models of two to four dimensions.
TEST(Run, FindsTheSameCellsOfRoundSolidsInAnyNumberOfRegions) {
  const samples::TemporaryFolder folder;  // the master's is the one that is read
  Ranks ranks = Ranks::launched();
  const char* given = std::getenv("BSP2_SEED");
  std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : 20051;
  broadcast(ranks, seed);
  for (int round = 0; round < samples::rounds(6); ++round, ++seed) {
    SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
    samples::RandomText text(seed);
    const int dimension = text.pick(2, 4);
    const fs::path known = fs::path(BSP2_SOURCE_DIR) / "tests" / "cases" / "curved-regions.csg";
    const bool is_known = round == 0 && given == nullptr;
    const fs::path path = is_known ? known : folder.path() / "model.csg";
    const std::string model = text.model(dimension, dimension < 4 ? 2 : 1, 0.6);
    if (!is_known && ranks.is_master()) std::ofstream(path) << model;
    RunOptions options = options_for(path, 1, 1);
    if (text.chance(0.3))
      options.level = static_cast<unsigned>(dimension == 2 ? text.pick(5, 20) : text.pick(5, 12));
    else
      options.tolerance =
          std::array{0.05, 0.2, 0.7}[static_cast<std::size_t>(dimension - 2)] * text.uniform(0.5, 1.5);
    options.keep_out = text.chance(0.3);
    std::vector<RunReport> reports;
    for (const unsigned regions : {1U, 20U, 200U, 1000U}) {
      options.regions = regions;
      options.order = text.chance(0.5) ? Order::depth : Order::priority;
      options.threads = static_cast<unsigned>(text.pick(1, 2));
      ranks.together([&] { reports.push_back(run(options, ranks).report); });
    }
    if (!ranks.is_master()) continue;
    options.regions = 1;
    reports.push_back(run(options).report);  // alone
    for (const RunReport& report : reports) {
      EXPECT_EQ(report.digest, reports[0].digest);
      EXPECT_EQ(report.in_cells, reports[0].in_cells);
      EXPECT_EQ(report.fuzzy_cells, reports[0].fuzzy_cells);
      EXPECT_EQ(report.in_volume, reports[0].in_volume);
      EXPECT_EQ(report.fuzzy_volume, reports[0].fuzzy_volume);
      EXPECT_EQ(report.inertia, reports[0].inertia);
      EXPECT_EQ(report.inertia_least, reports[0].inertia_least);
      EXPECT_EQ(report.inertia_most, reports[0].inertia_most);
    }
  }
}

TEST(Run, AgreesWithALevelAndWithOutCells) {
  RunOptions options = options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg", 8, 1);
  options.level = 14;
  options.keep_out = true;
  compare(options);
}

/// All ranks look for meshes that overlap themselves, as all parse; also where the surface alone is wanted,
/// which leaves out those that it proves to be sound, as the pyramid with a notch.
TEST(Run, ListsOverlappingMeshesOnAnyNumberOfRanks) {
  const samples::TemporaryFolder folder;
  const fs::path path = folder.path() / "model.csg";
  // Two corners cut off a cube of side 2, each twice: tetrahedra of volume 4 / 3 that have a pyramid in
  // common.
  const std::string crossing =
      "polyhedron(points = [[0,0,0],[2,0,0],[0,2,0],[0,0,2],[1,0,0],[-1,0,0],[1,2,0],[1,0,2]],"
      "faces = [[0,1,2],[0,3,1],[0,2,3],[1,3,2],[4,6,5],[4,5,7],[4,7,6],[5,6,7]]);";
  const std::string notched =
      "polyhedron(points = [[9,0,0],[13,0,0],[13,4,0],[9,4,0],[11,2,4],[11,2,1]],"
      "faces = [[0,1,4],[1,2,4],[2,3,4],[3,0,4],[1,0,5],[2,1,5],[3,2,5],[0,3,5]]);";
  std::ofstream(path) << "multmatrix([[3,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { " << crossing
                      << " } cube(1);";
  const fs::path sound = folder.path() / "sound.csg";
  std::ofstream(sound) << "cube(1); " << notched;
  Ranks ranks = Ranks::launched();
  for (const bool surface_only : {false, true}) {
    RunOptions options = options_for(path, 4, 1);
    options.boundary = options.surface_only = surface_only;
    RunReport report;
    ranks.together([&] { report = run(options, ranks).report; });
    EXPECT_EQ(report.warnings.size(), 1U) << "on all ranks, since --strict is about them";
    ASSERT_EQ(report.overlapping_meshes.size(), 1U);
    EXPECT_EQ(report.overlapping_meshes[0].place, path.string() + ":1:57");
    EXPECT_EQ(report.overlapping_meshes[0].triangles, 8U);
    EXPECT_DOUBLE_EQ(report.overlapping_meshes[0].volume_by_faces.value(), 3 * (4.0 / 3 + 4.0 / 3));
    if (ranks.is_master()) {
      EXPECT_LT(report.in_volume, 8 + 1 - 0.1);
    }
    options.model = sound;
    ranks.together([&] { report = run(options, ranks).report; });
    EXPECT_TRUE(report.warnings.empty() && report.overlapping_meshes.empty());
    EXPECT_EQ(report.has_cells, !surface_only);
    if (ranks.is_master()) {
      EXPECT_NEAR(report.in_volume, 1 + 16, 1e-12);
    }
  }
}

/// Each rank reads what the model imports: where that differs, regions of two models would be put together.
TEST(Run, RefusesImportsThatDifferBetweenRanks) {
  const samples::TemporaryFolder folder;
  Ranks ranks = Ranks::launched();
  const auto imported_with = [&](int size) {
    const std::string z = std::to_string(size);
    std::ofstream(folder.path() / "p.off")
        << "OFF 4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 " + z + "\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    std::ofstream(folder.path() / "model.csg") << "import(file = \"p.off\"); cube(3);";
    const RunOptions options = options_for(folder.path() / "model.csg", 4, 1);
    ranks.together([&] { run(options, ranks); });
  };
  EXPECT_NO_THROW(imported_with(5));
  if (ranks.count() == 1) return;
  try {
    imported_with(5 + (ranks.rank() == ranks.count() - 1 ? 1 : 0));
    ADD_FAILURE() << "nobody noticed";
  } catch (const Error& error) {
    EXPECT_NE(
        std::string(error.what())
            .find("rank " + std::to_string(ranks.count() - 1) + " has compiled another solid than rank 0"),
        std::string::npos)
        << error.what();
  }
}

/// Boxes, balls and cylinders anywhere, with differences and intersections.
std::string random_model(std::mt19937& random) {
  const auto number = [&](double low, double high) {
    return std::to_string(std::uniform_real_distribution<double>(low, high)(random));
  };
  std::string text;
  for (int i = 0; i < 40; ++i) {
    text += "multmatrix([[1,0,0," + number(0, 10) + "],[0,1,0," + number(0, 10) + "],[0,0,1," +
            number(0, 10) + "],[0,0,0,1]]) {";
    text += std::array{"difference", "intersection", "union"}[random() % 3] +
            std::string("() { cube(size=[") + number(1, 3) + "," + number(1, 3) + ",2]);";
    text += random() % 2 == 0 ? "sphere($fn=8,r=" + number(1, 2) + ");"
                              : "cylinder($fn=7,h=" + number(1, 3) + ",r1=1,r2=" + number(0, 1) + ");";
    text += "} }\n";
  }
  return text;
}

TEST(Run, FindsTheSameCellsOfRandomModels) {
  const samples::TemporaryFolder folder;  // the master's is the one that is read
  for (const unsigned seed : {1U, 2U, 3U}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const fs::path path = folder.path() / "model.csg";
    std::ofstream(path) << random_model(random);
    compare(options_for(path, 16, 1 + seed % 2));
  }
}

std::string digest_of(const SolidMesh& mesh) {
  dataflow::Digest digest;
  for (const auto& batch : mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) digest.add(*batch, cell);
  return digest.hex();
}

/// Region and volume of each cell, sorted.
using Volumes = std::vector<std::pair<std::uint32_t, double>>;

Volumes volumes_of(const SolidMesh& mesh) {
  Volumes volumes;
  for (const auto& batch : mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      volumes.emplace_back(batch->region[cell], batch->volume[cell]);
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

Volumes read_volumes(const fs::path& pvtu, const std::vector<std::int32_t>& rank_of_region) {
  vtkNew<vtkXMLPUnstructuredGridReader> reader;
  reader->SetFileName(pvtu.c_str());
  reader->Update();
  vtkCellData* data = reader->GetOutput()->GetCellData();
  Volumes volumes;
  for (vtkIdType i = 0; i < reader->GetOutput()->GetNumberOfCells(); ++i) {
    const auto region = static_cast<std::uint32_t>(data->GetArray("region")->GetComponent(i, 0));
    EXPECT_EQ(data->GetArray("rank")->GetComponent(i, 0), rank_of_region.at(region));
    volumes.emplace_back(region, data->GetArray("volume")->GetComponent(i, 0));
  }
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

/// Every way of collecting: the same cells, the same picture, the same files but for their number.
TEST(Run, CollectsTheSameCellsAndDrawsTheSamePictureEveryWay) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  RunOptions options = options_for(model, 16, 1);
  options.collect_cells = true;
  const RunResult alone = run(options);
  Ranks one;
  const std::string picture = render(one, alone, {.width = 300, .height = 200});
  for (const Collect collect : {Collect::automatic, Collect::master, Collect::tree, Collect::file}) {
    SCOPED_TRACE(static_cast<int>(collect));
    options.collect = collect;
    Ranks ranks = Ranks::launched();
    const samples::TemporaryFolder folder;
    RunResult result;
    std::string drawn;
    std::vector<std::uint64_t> held;
    ranks.together([&] {
      result = run(options, ranks);
      drawn = render(ranks, result, {.width = 300, .height = 200});
      std::string path = folder.path() / "solid.pvtu";
      broadcast(ranks, path);
      write_mesh(ranks, result, path);
      std::uint64_t cells = 0;
      for (const auto& batch : result.mesh.batches) cells += batch->size();
      held = gather(ranks, cells);
    });
    EXPECT_EQ(result.is_collected, collect != Collect::file || ranks.count() == 1);
    if (!ranks.is_master()) {
      EXPECT_TRUE(drawn.empty());
      continue;
    }
    EXPECT_TRUE(drawn == picture);
    EXPECT_EQ(std::accumulate(held.begin(), held.end(), std::uint64_t{0}), alone.report.in_cells);
    if (result.is_collected) {
      EXPECT_EQ(held[0], alone.report.in_cells);
      EXPECT_EQ(digest_of(result.mesh), alone.report.digest);
    }
    EXPECT_EQ(read_volumes(folder.path() / "solid.pvtu", result.rank_of_region), volumes_of(alone.mesh));
  }
}

/// Cells travel while others are computed, in rounds between which regions move, kept where they were found
/// or not. One rank begins with everything. What the master then has is one whole: all cells, and a tree that
/// finds them.
TEST(Run, CollectsWhileItComputes) {
  RunOptions options = options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / "leaning_tower.csg", 16, 1);
  options.collect_cells = true;
  const RunResult alone = run(options);
  const std::string picture = render(alone.mesh, alone.tree, {.width = 200, .height = 300});
  for (const bool keeps : {false, true}) {
    SCOPED_TRACE(keeps);
    options.collect = keeps ? Collect::master : Collect::tree;
    options.contacts = keeps;
    options.move_after_seconds = 0.1;
    Ranks ranks = Ranks::launched();
    options.first_rank_of_region.assign(16, ranks.count() - 1);
    RunResult result;
    ranks.together([&] { result = run(options, ranks); });
    if (!ranks.is_master()) {
      EXPECT_TRUE(result.mesh.batches.empty());
      continue;
    }
    EXPECT_EQ(result.report.digest, alone.report.digest);
    EXPECT_EQ(digest_of(result.mesh), alone.report.digest);
    EXPECT_TRUE(render(result.mesh, result.tree, {.width = 200, .height = 300}) == picture);
    // They come with the computation; afterwards only the trees do.
    std::uint64_t of_others = 0, came = 0, later = 0;
    for (const SuperstepRecord& record : result.report.supersteps) {
      if (record.name == "computation") {
        of_others += std::accumulate(record.cells.begin() + 1, record.cells.end(), std::uint64_t{0});
        came += record.bytes_received[0];
      }
      if (record.name == "collection") later += record.bytes_received[0];
    }
    EXPECT_GE(came, 200 * of_others);
    EXPECT_LE(later, 12 * result.tree.nodes.size() + 4 * result.tree.ids.size() +
                         8 * result.tree.hyperplanes.size() + 100000);
  }
}

/// Steps that end in the middle, also before any region is finished: what is left is drawn and travels at the
/// end.
TEST(Run, CollectsWhatIsLeftToo) {
  RunOptions options = options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / "leaning_tower.csg", 16, 1);
  options.collect_cells = true;
  options.cells = 3000;
  for (const Collect collect : {Collect::automatic, Collect::master, Collect::tree}) {
    SCOPED_TRACE(static_cast<int>(collect));
    options.collect = collect;
    options.order = collect == Collect::tree ? Order::priority : Order::depth;
    Ranks ranks = Ranks::launched();
    RunResult result;
    ranks.together([&] { result = run(options, ranks); });
    if (!ranks.is_master()) continue;
    EXPECT_FALSE(result.report.complete);
    EXPECT_GT(result.report.fuzzy_cells, 0U);
    EXPECT_EQ(digest_of(result.mesh), result.report.digest);
  }
}

/// Whatever the camera, the format and who draws.
TEST(Run, DrawsTheSamePictureInEveryFashion) {
  RunOptions options = options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg", 16, 1);
  options.collect_cells = true;
  options.level = 14;  // leaves FUZZY cells
  RunOptions of_all = options;
  of_all.collect = Collect::file;
  const RunResult alone = run(options);
  EXPECT_GT(alone.report.fuzzy_cells, 0U);
  Ranks one;
  PictureOptions plain{.width = 240, .height = 180};
  PictureOptions eye = plain, exploded = plain, vectors = plain, lined = plain;
  const auto middle = [&](int axis) { return (alone.report.lower[axis] + alone.report.upper[axis]) / 2; };
  eye.eye = {alone.report.upper[0] * 2, alone.report.lower[1] * 3, alone.report.upper[2] * 2};
  eye.look = {middle(0), middle(1), middle(2)};
  eye.edges = supersteps::Edges::cells;
  exploded.explode = 0.7;
  exploded.shade = Shade::region;
  vectors.format = PictureFormat::svg;
  lined.edges = Edges::feature;
  lined.shade = Shade::level;
  lined.legend = lined.axes = lined.transparent = true;
  PictureOptions lined_vectors = vectors;
  lined_vectors.edges = Edges::feature;
  for (const PictureOptions& view : {plain, eye, exploded, vectors, lined, lined_vectors}) {
    const std::string expected = render(one, alone, view);
    Ranks ranks = Ranks::launched();
    std::string drawn;
    ranks.together([&] { drawn = render(ranks, run(of_all, ranks), view); });
    EXPECT_EQ(drawn == expected, ranks.is_master());
  }
}

/// Skins are seen from the side on which they are, whoever draws them.
TEST(Run, DrawsTheSameSkinsInEveryFashion) {
  RunOptions options = options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg", 8, 1);
  options.curved = options.collect_cells = true;
  RunOptions of_all = options;
  of_all.collect = Collect::file;
  const RunResult alone = run(options);
  EXPECT_GT(alone.report.fuzzy_cells, 0U);
  Ranks one;
  const PictureOptions view{.width = 240, .height = 180};
  const std::string expected = render(one, alone, view);
  Ranks ranks = Ranks::launched();
  std::string drawn;
  ranks.together([&] { drawn = render(ranks, run(of_all, ranks), view); });
  EXPECT_EQ(drawn == expected, ranks.is_master());
}

/// A frame a step, the last of which shows the finished solid.
TEST(Run, ShowsAFrameAfterEachStep) {
  RunOptions options = options_for(fs::path(BSP2_SOURCE_DIR) / "examples" / "menger_sponge.csg", 16, 1);
  const RunReport whole = run(options).report;
  Ranks ranks = Ranks::launched();
  std::vector<unsigned> steps;
  std::vector<std::uint64_t> in_cells;
  options.budget_seconds = 0.001;
  options.steps = 5;
  ranks.together([&] {
    options.on_frame = [&](const RunResult& now, unsigned step) {
      const std::string picture = render(ranks, now, {.width = 60, .height = 60, .bounds = now.bounds});
      EXPECT_EQ(picture.empty(), !ranks.is_master());
      std::uint64_t in = 0;
      double volume = 0;
      for (const auto& batch : now.mesh.batches)
        for (std::size_t cell = 0; cell < batch->size(); ++cell)
          if (batch->label[cell] == geometry::Label::in) ++in, volume += batch->volume[cell];
      steps.push_back(step);
      std::uint64_t all = 0;
      for (const std::uint64_t part : all_gather(ranks, in)) all += part;
      in_cells.push_back(all);
      EXPECT_LE(volume, whole.in_volume * (1 + 1e-9));
    };
    const RunReport last = run(options, ranks).report;
    if (!ranks.is_master()) return;
    EXPECT_EQ(in_cells.back(), last.in_cells);
    if (last.complete) {
      EXPECT_EQ(last.digest, whole.digest);
    }
  });
  ASSERT_FALSE(steps.empty());
  for (std::size_t i = 0; i < steps.size(); ++i) EXPECT_EQ(steps[i], i);
}

TEST(Run, ReadsTheModelOnceAndTellsAllWhatIsWrongWithIt) {
  const samples::TemporaryFolder folder;
  const fs::path path = folder.path() / "model.csg";
  std::ofstream(path) << "cube(size=[1,2,3])";
  Ranks ranks = Ranks::launched();
  std::string text;
  try {
    ranks.together([&] { run(options_for(path, 1, 1), ranks); });
  } catch (const Error& error) {
    text = error.what();
  }
  EXPECT_NE(text.find("model.csg:1:"), std::string::npos) << text;
  if (ranks.count() > 1) {
    EXPECT_NE(text.find("(compilation, rank 0)"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace bsp2::supersteps
