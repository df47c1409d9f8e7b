// Resolution on several ranks, and regions that move between them, against one process.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>
#include <string>
#include <tuple>

#include "bsp2/supersteps/loop/run.hpp"
#include "loop/progress.hpp"
#include "ranks/exchange.hpp"
#include "resolution/equal_breps.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::supersteps {
namespace {

namespace fs = std::filesystem;

RunOptions options_for(const fs::path& model, unsigned regions) {
  RunOptions options;
  options.model = model;
  options.regions = regions;
  options.threads = 1;
  options.boundary = options.contacts = true;
  return options;
}

fs::path example(const char* name) {
  return fs::path(BSP2_SOURCE_DIR) / "examples" / (std::string(name) + ".csg");
}

using ContactKey =
    std::tuple<std::array<std::uint64_t, 2>, std::array<std::uint16_t, 2>, geometry::HyperplaneId>;
/// Sorted, with the areas.
using Contacts = std::vector<std::pair<ContactKey, double>>;

Contacts contacts_of(const std::vector<geometry::Contact>& contacts) {
  Contacts keys;
  for (const auto& contact : contacts)
    keys.push_back({{contact.cell, contact.facet, contact.hyperplane}, contact.area});
  std::sort(keys.begin(), keys.end());
  return keys;
}

std::string bytes_of(const std::vector<geometry::Contact>& contacts) {
  return {reinterpret_cast<const char*>(contacts.data()), contacts.size() * sizeof(geometry::Contact)};
}
std::vector<geometry::Contact> contacts_from(const std::vector<std::string>& shares) {
  std::vector<geometry::Contact> contacts;
  for (const std::string& share : shares) {
    const std::size_t before = contacts.size();
    contacts.resize(before + share.size() / sizeof(geometry::Contact));
    std::copy(share.begin(), share.end(), reinterpret_cast<char*>(contacts.data() + before));
  }
  return contacts;
}

void expect_closed(const RunResult& result) {
  ASSERT_TRUE(result.boundary && result.report.boundary);
  EXPECT_TRUE(result.boundary->is_closed());
  EXPECT_TRUE(result.report.boundary->closed);
  EXPECT_NEAR(result.boundary->volume(), result.report.in_volume, 1e-9 * result.report.in_volume);
}

void expect_same(const RunResult& a, const RunResult& b) {
  EXPECT_EQ(a.report.digest, b.report.digest);
  ASSERT_TRUE(a.boundary && b.boundary);
  EXPECT_TRUE(a.boundary->points == b.boundary->points);
  EXPECT_TRUE(a.boundary->triangles == b.boundary->triangles);
  EXPECT_TRUE(a.boundary->owner == b.boundary->owner);
}

/// A model of this text in the master's folder, by the same name on all ranks. Collective.
std::string model_in(const samples::TemporaryFolder& folder, const std::string& text) {
  std::string name = folder.path() / "model.csg";
  Ranks ranks = Ranks::launched();
  ranks.together([&] {
    if (ranks.is_master()) std::ofstream(name) << text;
    broadcast(ranks, name);
  });
  return name;
}

/// Runs on all ranks. @return the master's result, with the contacts of all ranks; nothing elsewhere.
std::optional<RunResult> together(const RunOptions& options) {
  Ranks ranks = Ranks::launched();
  RunResult result;
  ranks.together([&] {
    result = run(options, ranks);
    const auto shares = gather(ranks, bytes_of(result.contacts));
    result.contacts = contacts_from(shares);
  });
  if (!ranks.is_master()) return std::nullopt;
  return result;
}

TEST(Resolution, FindsTheSameTrianglesAndContactsOnAnyNumberOfRanks) {
  for (const char* name : {"every_node", "mechanical_piece", "menger_sponge", "touching_solids"})
    for (const unsigned regions : {4U, 32U})
      for (const Collect collect : {Collect::master, Collect::file}) {
        SCOPED_TRACE(std::string(name) + ", regions " + std::to_string(regions));
        RunOptions options = options_for(example(name), regions);
        options.collect = collect;
        const auto result = together(options);
        if (!result) continue;
        options.threads = 2;
        const RunResult alone = run(options);
        expect_closed(*result);
        expect_same(*result, alone);
        if (name != std::string("every_node")) {  // there no cells touch
          EXPECT_GT(alone.contacts.size(), 1U);
        }
        EXPECT_TRUE(contacts_of(result->contacts) == contacts_of(alone.contacts));
      }
}

/// Boxes and balls on a grid, pushed into each other and touching, some of which are one part.
std::string random_parts(std::mt19937_64& random) {
  std::ostringstream text;
  const auto number = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  for (int i = 0; i < 6; ++i) {
    text << "part(name=\"" << i % 4 << "\") multmatrix([[1,0,0," << number(0, 3) << "],[0,1,0,"
         << number(0, 3) << "],[0,0,1," << number(0, 3) << "],[0,0,0,1]]) ";
    if (i % 3 == 2)
      text << "sphere(r=" << number(1, 3) << ".5,$fn=" << number(5, 9) << ");\n";
    else
      text << "cube([" << number(1, 3) << ',' << number(1, 3) << ',' << number(1, 3) << "]);\n";
  }
  return text.str();
}

/// With cells and without, of parts that touch too: the complex, and the surface beside it.
TEST(Resolution, FindsTheSameFacesOnAnyNumberOfRanks) {
  std::uint64_t seed = 0;
  {
    Ranks ranks = Ranks::launched();
    if (ranks.is_master()) seed = samples::new_seed();
    ranks.together([&] { broadcast(ranks, seed); });
  }
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937_64 random(seed);
  const samples::TemporaryFolder folder;
  const std::string touching = "part(name=\"a\") cube(2); part(name=\"b\") cube(3, center=true);";
  bool have_interfaces = false, is_master = false;
  for (int round = 0; round < 4 + samples::rounds(6); ++round) {
    const std::string model = round == 0   ? example("mechanical_piece").string()
                              : round == 1 ? example("touching_solids").string()
                              : round < 4  ? model_in(folder, touching)
                                           : model_in(folder, random_parts(random));
    RunOptions options = options_for(model, 4);
    options.faces = true;
    options.surface_only = round % 2 == 1;
    options.contacts = !options.surface_only;
    const auto result = together(options);
    if (!result) continue;
    SCOPED_TRACE(round);
    is_master = true;
    const RunResult alone = run(options);
    expect_same(*result, alone);
    ASSERT_TRUE(result->faces && alone.faces);
    ASSERT_NO_FATAL_FAILURE(expect_same(*result->faces, *alone.faces));
    EXPECT_TRUE(alone.faces->is_closed);
    have_interfaces = have_interfaces || geometry::has_interfaces(*alone.faces);
  }
  EXPECT_EQ(have_interfaces, is_master);
}

/// Round solids name their common planes each for itself, and no rank has all of them.
TEST(Resolution, NamesPlanesAlikeOnAllRanks) {
  for (const unsigned regions : {4U, 32U}) {
    SCOPED_TRACE(regions);
    RunOptions options =
        options_for(fs::path(BSP2_SOURCE_DIR) / "tests" / "cases" / "curved-two-equal-balls.csg", regions);
    options.tolerance = 0.25;
    const auto result = together(options);
    if (!result) continue;
    const RunResult alone = run(options);
    expect_closed(*result);
    expect_same(*result, alone);
    EXPECT_TRUE(contacts_of(result->contacts) == contacts_of(alone.contacts));
  }
}

TEST(Resolution, FindsTheSameSurfaceForAnyNumberOfRegions) {
  for (const char* name : {"mechanical_piece", "touching_solids"}) {
    SCOPED_TRACE(name);
    const auto result = together(options_for(example(name), 16));
    if (!result) continue;
    const RunResult whole = run(options_for(example(name), 1));
    expect_same(*result, whole);
  }
}

/// A model whose operands share no hyperplanes.
fs::path spheres_in(const fs::path& folder) {
  std::string text = "difference() { sphere(r=10,$fn=30);\n";
  for (int i = 0; i < 12; ++i)
    text += "multmatrix([[1,0,0.1," + std::to_string(10 * std::cos(i)) + "],[0,1,0.2," +
            std::to_string(10 * std::sin(i)) + "],[0.3,0,1," + std::to_string(0.7 * i - 3.6) +
            "],[0,0,0,1]]) { sphere(r=3,$fn=" + std::to_string(10 + i) + "); }\n";
  const fs::path path = folder / "spheres.csg";
  std::ofstream(path) << text << "}\n";
  return path;
}

TEST(Resolution, FindsTheSameSurfaceWithoutCells) {
  const samples::TemporaryFolder folder;
  for (const fs::path& model : {spheres_in(folder.path()), example("mechanical_piece"),
                                example("menger_sponge"), example("touching_solids")}) {
    SCOPED_TRACE(model);
    RunOptions options;
    options.model = model;
    options.threads = 1;
    options.boundary = options.surface_only = true;
    const auto result = together(options);
    if (!result) continue;
    options.surface_only = false;
    const RunResult of_cells = run(options);
    ASSERT_TRUE(result->report.boundary && of_cells.report.boundary);
    EXPECT_EQ(result->report.boundary->digest, of_cells.report.boundary->digest);
    EXPECT_NEAR(result->report.in_volume, of_cells.report.in_volume, 1e-11 * of_cells.report.in_volume);
    if (model.filename() == "spheres.csg") {
      EXPECT_FALSE(result->report.has_cells);
    }
  }
}

/// Boxes, some on a grid, prisms and balls, of which some are left out of the others.
std::string random_solids(std::mt19937_64& random) {
  const auto number = [&](double low, double high) {
    return std::to_string(std::uniform_real_distribution<double>(low, high)(random));
  };
  const auto whole = [&](int low, int high) {
    return std::to_string(std::uniform_int_distribution<int>(low, high)(random));
  };
  const auto solid = [&] {
    const auto kind = random() % 4;
    std::string text = "multmatrix([[1,0," + (kind > 1 ? number(-0.3, 0.3) : "0") + "," +
                       (kind == 0 ? whole(0, 9) : number(0, 10)) + "],[" +
                       (kind > 1 ? number(-0.3, 0.3) : "0") + ",1,0," +
                       (kind == 0 ? whole(0, 6) : number(0, 7)) + "],[0,0,1," +
                       (kind == 0 ? whole(0, 4) : number(0, 5)) + "],[0,0,0,1]]) ";
    if (kind < 2) return text + "cube(size=[" + whole(1, 2) + "," + whole(1, 2) + "," + whole(1, 3) + "]);\n";
    if (kind == 2) return text + "cylinder(h=2,r1=1,r2=0.7,$fn=" + whole(5, 12) + ");\n";
    return text + "sphere(r=0.8,$fn=" + whole(8, 16) + ");\n";
  };
  std::string text = "difference() { union() {\n";
  for (int i = 0; i < 100; ++i) text += solid();
  text += "}\n";
  for (int i = 0; i < 12; ++i) text += solid();
  return text + "}\n";
}

/// Found with and without cells, put together by all ranks and threads: byte for byte that of one thread.
TEST(Resolution, PutsTheSameSurfaceTogetherOnAnyRanksAndThreads) {
  std::uint64_t seed = 0;
  {
    Ranks ranks = Ranks::launched();
    if (ranks.is_master()) seed = samples::new_seed();
    ranks.together([&] { broadcast(ranks, seed); });
  }
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937_64 random(seed);
  std::size_t most_triangles = 0;
  for (int round = 0; round < samples::rounds(3); ++round) {
    const samples::TemporaryFolder folder;
    RunOptions options;
    options.model = model_in(folder, random_solids(random));
    options.boundary = true;
    std::optional<RunResult> one;
    for (const unsigned threads : {1U, 2U})
      for (const bool surface_only : {true, false}) {
        SCOPED_TRACE(std::to_string(threads) +
                     (surface_only ? " threads, without cells" : " threads, of cells"));
        options.threads = threads;
        options.surface_only = surface_only;
        const auto result = together(options);
        if (!result) continue;
        if (!one) {
          RunOptions of_one = options;
          of_one.threads = 1;
          of_one.surface_only = false;
          of_one.regions = 1;
          one = run(of_one);
          most_triangles = std::max(most_triangles, one->boundary->triangles.size());
        }
        ASSERT_TRUE(result->boundary && result->report.boundary);
        EXPECT_TRUE(result->boundary->is_closed());
        EXPECT_TRUE(result->boundary->points == one->boundary->points);
        EXPECT_TRUE(result->boundary->triangles == one->boundary->triangles);
        EXPECT_TRUE(result->boundary->owner == one->boundary->owner);
        EXPECT_EQ(result->report.boundary->digest, one->report.boundary->digest);
        EXPECT_NE(result->report.has_cells, surface_only);
      }
  }
  if (Ranks::launched().is_master()) {
    EXPECT_GT(most_triangles, 2048U);  // several shares of work for threads
  }
}

/// Before cells are made, where operands share no hyperplanes.
TEST(Resolution, TracesTheSameSurfaceBesideCells) {
  const samples::TemporaryFolder folder;
  for (const fs::path& model : {spheres_in(folder.path()), example("polyhedra")}) {
    SCOPED_TRACE(model);
    RunOptions options = options_for(model, 8);
    options.boundary = options.traces_boundary = true;
    options.contacts = false;
    const auto result = together(options);
    if (!result) continue;
    options.traces_boundary = false;
    const RunResult glued = run(options);
    ASSERT_TRUE(result->report.boundary && glued.report.boundary);
    EXPECT_EQ(result->report.boundary->digest, glued.report.boundary->digest);
    EXPECT_EQ(result->report.digest, glued.report.digest);
    if (model.filename() == "spheres.csg") {
      EXPECT_EQ(result->report.supersteps.at(2).name, "resolution");
      EXPECT_EQ(glued.report.supersteps.at(2).name, "distribution");
    }
  }
}

/// One rank cannot take many facets that end in one point; the others, which could go on, hear of it.
TEST(Resolution, FindsCellsWhereOneRankFindsNoSurfaceWithoutThem) {
  const auto at = [](double x, double shear, const std::string& child) {
    return "multmatrix([[1,0," + std::to_string(shear) + "," + std::to_string(x) +
           "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { " + child + " }\n";
  };
  std::string text = "union() {\n";
  for (int i = 0; i < 24; ++i) text += at(0, 0.1 * i - 1.2, "cylinder(h=1,r1=0,r2=0.5,$fn=140);");
  for (int i = 0; i < 60; ++i) text += at(10 + 0.5 * i, 0, "sphere(r=1,$fn=20);");
  RunOptions options;
  const samples::TemporaryFolder folder;
  options.model = folder.path() / "apex.csg";
  std::ofstream(options.model) << text << "}\n";
  options.threads = 1;
  options.boundary = options.surface_only = true;
  const auto result = together(options);
  if (!result) return;
  EXPECT_TRUE(result->report.has_cells);
  options.surface_only = false;
  const RunResult glued = run(options);
  EXPECT_EQ(result->report.boundary->digest, glued.report.boundary->digest);
  options.traces_boundary = true;
  EXPECT_EQ(run(options).report.boundary->digest, glued.report.boundary->digest);
}

/// A block of n x n x n units with three square tunnels through each.
std::string block(int n) {
  const auto tunnel = [](const std::string& x, const std::string& y, const std::string& z,
                         const std::string& size) {
    return "multmatrix([[1,0,0," + x + "],[0,1,0," + y + "],[0,0,1," + z + "],[0,0,0,1]]) { cube(size=[" +
           size + "]); }\n";
  };
  const std::string length = std::to_string(n + 2), square = "0.5,0.5";
  std::string text = "difference() { cube(size=[" + std::to_string(n) + "," + std::to_string(n) + "," +
                     std::to_string(n) + "]);\n";
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const std::string a = std::to_string(i + 0.25), b = std::to_string(j + 0.25);
      text += tunnel("-1", a, b, length + "," + square);
      text += tunnel(a, "-1", b, "0.5," + length + ",0.5");
      text += tunnel(a, b, "-1", square + "," + length);
    }
  return text + "}\n";
}

/// Twice as long, eight times the cells, but about four times the facets on the cuts: only these travel.
TEST(Resolution, SendsFacetsOnCutsOnly) {
  const samples::TemporaryFolder folder;
  const fs::path model = folder.path() / "model.csg";
  std::vector<double> cells, bytes;
  int ranks = 1;
  for (const int n : {4, 8}) {
    std::ofstream(model) << block(n);
    RunOptions options = options_for(model, 16);
    options.contacts = false;
    const auto result = together(options);
    if (!result) continue;
    expect_closed(*result);
    cells.push_back(static_cast<double>(result->report.in_cells));
    for (const auto& record : result->report.supersteps)
      if (record.name == "resolution" && record.step == 0)
        bytes.push_back(std::accumulate(record.bytes_sent.begin(), record.bytes_sent.end(), 0.0));
    ranks = static_cast<int>(result->report.ranks);
  }
  if (ranks == 1) return;  // nothing travels, or this is not the master
  ASSERT_EQ(bytes.size(), 2U);
  EXPECT_GT(cells[1], 5 * cells[0]);
  EXPECT_GT(bytes[0], 0);
  EXPECT_LT(bytes[1], 5 * bytes[0]);
}

/// Many small things in one corner, and a few elsewhere.
std::string crowded_corner(std::mt19937& random, int count = 500) {
  const auto number = [&](double low, double high) {
    return std::to_string(std::uniform_real_distribution<double>(low, high)(random));
  };
  std::string text = "cube(size=[100,90,80]);\n";
  for (int i = 0; i < count; ++i) {
    const bool in_corner = i % 10 != 0;
    text += "multmatrix([[1,0,0," + number(0, in_corner ? 12 : 100) + "],[0,1,0," +
            number(0, in_corner ? 12 : 90) + "],[0,0,1," + number(76, in_corner ? 82 : 90) + "],[0,0,0,1]])";
    text += " { sphere($fn=14,r=" + number(0.5, 2) + "); }\n";
  }
  return text;
}

TEST(Moving, LeavesTheResultAsItIs) {
  const samples::TemporaryFolder folder;
  std::mt19937 random(5);
  const fs::path model = folder.path() / "model.csg";
  std::ofstream(model) << crowded_corner(random);
  RunOptions options = options_for(model, 16);
  options.move_after_seconds.reset();
  const auto still = together(options);
  options.move_after_seconds = 0;
  options.budget_seconds = 0.01;
  options.steps = 10000;
  options.first_rank_of_region.assign(16, Ranks::launched().count() - 1);  // the others have nothing at first
  for (const Collect collect : {Collect::tree, Collect::file}) {
    options.collect = collect;
    const auto moved = together(options);
    if (!moved) continue;
    EXPECT_TRUE(moved->report.complete);
    expect_closed(*moved);
    expect_same(*moved, *still);
    if (moved->report.ranks > 1) {
      EXPECT_NE(moved->rank_of_region, options.first_rank_of_region);
    }
  }
}

/// The regions with the most cells all to the last rank, the others to the others.
std::vector<std::int32_t> one_rank_has_the_dear_ones(const RunResult& result) {
  std::vector<std::pair<std::size_t, std::size_t>> regions(result.rank_of_region.size());  // cells, number
  for (std::size_t i = 0; i < regions.size(); ++i) regions[i].second = i;
  for (const auto& batch : result.mesh.batches)
    for (const std::uint32_t region : batch->region) ++regions[region].first;
  std::sort(regions.begin(), regions.end());
  const auto ranks = static_cast<std::int32_t>(result.report.ranks);
  std::vector<std::int32_t> owner(regions.size(), ranks - 1);
  for (std::size_t i = 0; i < regions.size() / 2; ++i)
    owner[regions[i].second] = static_cast<std::int32_t>(i) % ranks;
  return owner;
}

/// Without budget or steps: only a rank without work can end a round.
TEST(Moving, IsBegunByARankThatHasNothingLeftToDo) {
  const samples::TemporaryFolder folder;
  std::mt19937 random(6);
  const fs::path model = folder.path() / "model.csg";
  std::ofstream(model) << crowded_corner(random, 2000);
  RunOptions options = options_for(model, 64);
  options.boundary = options.contacts = false;
  options.collect = Collect::master;
  options.move_after_seconds.reset();
  const auto still = together(options);
  if (still) options.first_rank_of_region = one_rank_has_the_dear_ones(*still);
  std::uint64_t before = 0;  // cells that the last rank finds
  for (const std::optional<double> move_after : {std::optional<double>(), std::optional(0.02)}) {
    options.move_after_seconds = move_after;
    const auto result = together(options);
    if (!result) continue;
    EXPECT_TRUE(result->report.complete);
    EXPECT_EQ(result->report.digest, still->report.digest);
    EXPECT_EQ(result->report.in_cells, still->report.in_cells);
    EXPECT_EQ(result->report.in_volume, still->report.in_volume);
    std::vector<std::uint64_t> cells;
    double idle = 0;  // how long another had nothing left while the last one computed
    for (const auto& record : result->report.supersteps)
      if (record.name == "computation") {
        cells = record.cells;
        const auto& work = record.work_seconds;
        idle = work.back() - *std::min_element(work.begin(), work.end());
      }
    const bool is_moved = result->rank_of_region != options.first_rank_of_region;
    if (!move_after || result->report.ranks == 1) {
      EXPECT_FALSE(is_moved);
      before = cells.back();
    } else {
      // What was given away is computed by whoever had nothing left; how much depends on how fast the machine
      // is. A region may come back in the end, so the owners need not differ.
      EXPECT_TRUE(cells.back() < before || idle < 0.5) << idle;
      EXPECT_LE(cells.back(), before);
    }
  }
}

TEST(Assigning, NeighboursGoTogetherWithAboutAsMuchWorkEach) {
  EXPECT_EQ(assign_neighbours({1, 1, 1, 1}, 2), (std::vector<std::int32_t>{0, 0, 1, 1}));
  EXPECT_EQ(assign_neighbours({0, 0, 0}, 3).size(), 3U);
  EXPECT_TRUE(assign_neighbours({}, 3).empty());
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i) {
    const int ranks = 1 + static_cast<int>(random() % 7);
    std::vector<double> work;
    for (unsigned k = 1 + random() % 60; k > 0; --k) work.push_back(static_cast<double>(1 + random() % 100));
    const auto owner = assign_neighbours(work, ranks);
    ASSERT_EQ(owner.size(), work.size());
    EXPECT_TRUE(std::ranges::is_sorted(owner));
    std::vector<double> load(static_cast<std::size_t>(ranks));
    for (std::size_t k = 0; k < work.size(); ++k) load.at(static_cast<std::size_t>(owner[k])) += work[k];
    const double mean = std::accumulate(work.begin(), work.end(), 0.0) / ranks;
    for (const double each : load) EXPECT_NEAR(each, mean, std::ranges::max(work) * (1 + 1e-9));
  }
}

TEST(Moving, GivesEachRankAboutAsMuchAndMovesNoMoreThanItMust) {
  // Balanced as it is: all stay.
  EXPECT_EQ(reassign_regions({4, 2, 3, 3}, {0, 0, 1, 1}, 2), (std::vector<std::int32_t>{0, 0, 1, 1}));
  // One rank has nothing left.
  EXPECT_EQ(reassign_regions({5, 5}, {1, 1}, 2), (std::vector<std::int32_t>{1, 0}));
  // No work, no move.
  EXPECT_EQ(reassign_regions({0, 0, 7}, {1, 1, 0}, 3), (std::vector<std::int32_t>{1, 1, 0}));
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    const int ranks = 1 + static_cast<int>(random() % 7);
    std::vector<double> work;
    std::vector<std::int32_t> owner;
    for (unsigned k = random() % 60; k > 0; --k) {
      work.push_back(static_cast<double>(random() % 100));
      owner.push_back(static_cast<std::int32_t>(random() % static_cast<unsigned>(ranks)));
    }
    const auto now = reassign_regions(work, owner, ranks);
    ASSERT_EQ(now.size(), work.size());
    std::vector<double> load(static_cast<std::size_t>(ranks));
    double total = 0, largest = 0;
    for (std::size_t k = 0; k < work.size(); ++k) {
      load.at(static_cast<std::size_t>(now[k])) += work[k];
      total += work[k];
      largest = std::max(largest, work[k]);
    }
    EXPECT_LE(*std::max_element(load.begin(), load.end()), 1.05 * total / ranks + largest);
  }
}

TEST(Run, CountsTheCellsOfAllRanksTogether) {
  RunOptions options = options_for(example("leaning_tower"), 32);
  options.boundary = options.contacts = options.collect_cells = false;
  options.cells = 3000;
  const auto result = together(options);
  if (!result) return;
  EXPECT_FALSE(result->report.complete);
  const std::uint64_t cells =
      result->report.in_cells + result->report.fuzzy_cells;  // those that are left undecided, too
  EXPECT_GE(cells, 2900U);
  EXPECT_LE(cells, 4500U);
  EXPECT_GE(result->report.in_cells, 2500U);
}

/// Round solids are not decided to the end: what is thin enough is left FUZZY, and counts.
TEST(Run, CountsTheFuzzyCellsOfRoundSolidsToo) {
  const samples::TemporaryFolder folder;
  RunOptions options = options_for(model_in(folder, "ball(3);\n"), 8);
  options.boundary = options.contacts = false;
  options.tolerance = 0.0005;
  options.cells = 1000;
  for (const Order order : {Order::depth, Order::priority}) {
    options.order = order;
    const auto result = together(options);
    if (!result) continue;
    EXPECT_FALSE(result->report.complete);
    const std::uint64_t cells = result->report.in_cells + result->report.fuzzy_cells;
    EXPECT_GE(cells, 950U);
    EXPECT_LE(cells, 1600U);
  }
}

/// The name of a snapshot in the master's folder, the same on all ranks. Collective.
std::string snapshot_in(const samples::TemporaryFolder& folder) {
  std::string name = folder.path() / "run.h5";
  Ranks ranks = Ranks::launched();
  ranks.together([&] { broadcast(ranks, name); });
  return name;
}

TEST(Resume, GoesOnFromASnapshotWithTheCellsLeftWhereTheyAre) {
  RunOptions options = options_for(example("mechanical_piece"), 16);
  options.collect = Collect::file;
  const auto whole = together(options);
  const samples::TemporaryFolder folder;
  const std::string name = snapshot_in(folder);
  RunOptions part = options;
  part.boundary = part.contacts = false;
  part.snapshot = name;
  part.cells = 60;
  const auto stopped = together(part);
  if (stopped) {
    EXPECT_FALSE(stopped->report.complete);
  }
  options.resume = name;
  const auto resumed = together(options);
  if (!resumed) return;
  EXPECT_TRUE(resumed->report.complete);
  EXPECT_EQ(resumed->report.in_cells, whole->report.in_cells);
  expect_same(*resumed, *whole);
}

/// What constructs make of round solids lies between polytopes, and what nothing is known of stays FUZZY,
/// also after a pause.
TEST(Resume, EndsWithTheCellsOfAnUninterruptedRunWhereConstructsEncloseRoundSolids) {
  const samples::TemporaryFolder folder;
  const std::string model = model_in(folder, R"(
    difference() {
      minkowski() { cuboid([2, 1, 1]); ball(3, 0.5, $fn = 12); }
      projective([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0.1, 0, 0, 1]]) torus(1, 0.3, $fn = 12);
      hull() { symmetric_difference() { ball(3, 0.3, $fn = 12); cuboid([2, 0.2, 0.2]); } }
      ball(3, 0.4);
      projective([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0.2, 0, 1]])
        nurbs(degree = [2, 1], points = [[[1, 0, 0.2], [1, 0, 0.4]], [[1, 1, 0.2], [1, 1, 0.4]],
                                         [[0, 1, 0.2], [0, 1, 0.4]]]);
    })");
  RunOptions options = options_for(model, 8);
  options.collect = Collect::file;
  options.boundary = options.contacts = false;
  options.tolerance = 0.05;
  const auto whole = together(options);
  for (const std::uint64_t cells : {1U, 50U, 400U}) {
    const samples::TemporaryFolder other;
    const std::string name = snapshot_in(other);
    RunOptions part = options;
    part.snapshot = name;
    part.cells = cells;
    const auto stopped = together(part);
    if (stopped) {
      EXPECT_FALSE(stopped->report.complete);
      EXPECT_GT(stopped->report.fuzzy_cells, 0U);
    }
    RunOptions rest = part;
    rest.cells.reset();
    rest.resume = name;
    const auto resumed = together(rest);
    if (!resumed) continue;
    EXPECT_TRUE(resumed->report.complete);
    EXPECT_GT(resumed->report.in_cells, 400U);
    EXPECT_EQ(resumed->report.in_cells, whole->report.in_cells);
    EXPECT_EQ(resumed->report.fuzzy_cells, whole->report.fuzzy_cells);
    EXPECT_EQ(resumed->report.digest, whole->report.digest);
  }
}

/// The angle and the eye are in the snapshot: attributes that all ranks write together.
TEST(Resume, KeepsTheAngleAndTheEyeOfTheRun) {
  RunOptions options = options_for(example("mechanical_piece"), 8);
  options.collect = Collect::file;
  options.boundary = options.contacts = false;
  options.curved = true;
  options.tolerance = 0.2;
  options.angle = 1;
  options.eye = {60, -40, 30};
  const auto whole = together(options);
  const samples::TemporaryFolder folder;
  const std::string name = snapshot_in(folder);
  RunOptions part = options;
  part.snapshot = name;
  part.level = 6;
  together(part);
  RunOptions rest = options_for(example("mechanical_piece"), 8);
  rest.collect = Collect::file;
  rest.boundary = rest.contacts = false;
  rest.resume = name;
  rest.level = 1000;
  const auto resumed = together(rest);
  if (!resumed) return;
  EXPECT_EQ(resumed->report.angle, options.angle);
  EXPECT_EQ(resumed->report.eye, options.eye);
  EXPECT_EQ(resumed->report.in_cells, whole->report.in_cells);
  EXPECT_EQ(resumed->report.fuzzy_cells, whole->report.fuzzy_cells);
  EXPECT_EQ(resumed->report.digest, whole->report.digest);
}

}  // namespace
}  // namespace bsp2::supersteps
