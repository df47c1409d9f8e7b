#include "viewer/levels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "serving/reader.hpp"
#include "support/rounds.hpp"
#include "viewed.hpp"
#include "viewer/packing.hpp"

namespace bsp2::api {
namespace {

using nlohmann::json;
using Triangle = std::array<Point, 3>;

double rounded(double x, double step) { return std::round(x / step) * step; }

Triangle on_lattice(Triangle triangle, double step) {
  for (Point& corner : triangle)
    for (double& x : corner) x = rounded(x, step);
  return triangle;
}

bool is_collapsed(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

/// The triangles of a message in their order, each with what is told of its owner.
std::vector<std::pair<Triangle, double>> triangles_of(const Decoded& message, const char* counts,
                                                      const char* told) {
  const auto points = message.points();
  const auto corners = message.whole("triangles"), of_owner = message.whole(counts);
  const auto values = message.real(told);
  std::vector<std::pair<Triangle, double>> all;
  std::size_t at = 0;
  for (std::size_t owner = 0; owner < of_owner.size(); ++owner)
    for (std::int64_t i = 0; i < of_owner[owner]; ++i, at += 3)
      all.push_back(
          {{points.at(corners.at(at)), points.at(corners.at(at + 1)), points.at(corners.at(at + 2))},
           values.at(owner)});
  EXPECT_EQ(at, corners.size());
  return all;
}

/// Of each message at each level: what is left is what does not collapse, on the lattice, in its order.
void expect_levels(const std::string& bytes) {
  const Decoded finest(bytes);
  const bool is_piece = finest.header["kind"] == "piece";
  const char *counts = is_piece ? "ofFace" : "ofCell", *told = is_piece ? "areas" : "volumes";
  const auto all = triangles_of(finest, counts, told);
  const int first = finest.header["finest"];
  for (int level = first; level < first + 18; level += 3) {
    const double step = std::exp2(level);
    const Decoded coarse(coarser(bytes, level));
    EXPECT_EQ(coarse.header["step"], step);
    std::vector<std::pair<Triangle, double>> expected;
    for (const auto& [triangle, value] : all)
      if (const Triangle moved = on_lattice(triangle, step); !is_collapsed(moved))
        expected.emplace_back(moved, value);
    ASSERT_EQ(triangles_of(coarse, counts, told), expected) << "level " << level;
    for (const char* name : {"box", "run", "finest", is_piece ? "area" : "region"})
      EXPECT_EQ(coarse.header[name], finest.header[name]);
    EXPECT_EQ(is_piece ? coarse.points().size() : coarse.whole("parts").size(), coarse.points().size());
  }
  const Decoded none(coarser(bytes, Detail::nothing));
  EXPECT_TRUE(none.whole("triangles").empty() && none.whole("positions").empty() &&
              none.whole(counts).empty());
  EXPECT_EQ(none.header["box"], finest.header["box"]);
}

TEST(Levels, WhatIsLeftOfAMessageIsWhatDoesNotCollapse) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(3); ++round) {
    const auto result = evaluated(random_model(random));
    for (const std::string& bytes : surface_messages(3, *result.faces, 1U << 30)) expect_levels(bytes);
    for (const auto& batch : result.mesh.batches)
      if (!batch->empty()) expect_levels(region_message(3, batch->region.front(), {batch}, {}, 1U << 30));
  }
}

/// Pieces at one level have no gaps between them, whatever the level.
TEST(Levels, PiecesAtOneLevelAreClosedTogether) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  const auto result = evaluated(random_model(random));
  const auto pieces = surface_messages(3, *result.faces, 1U << 30);
  for (int level = -12; level < 3; ++level) {
    std::map<std::int64_t, std::map<std::pair<Point, Point>, int>> uses;
    for (const std::string& bytes : pieces) {
      const Decoded message(coarser(bytes, std::max(level, Decoded(bytes).header["finest"].get<int>())));
      for (const auto& [t, area] : triangles_of(message, "ofFace", "areas"))
        for (std::size_t i = 0; i < 3; ++i) {
          ++uses[message.header["part"]][{t[i], t[(i + 1) % 3]}];
          --uses[message.header["part"]][{t[(i + 1) % 3], t[i]}];
        }
    }
    for (const auto& [part, edges] : uses)
      for (const auto& [edge, count] : edges) ASSERT_EQ(count, 0) << "level " << level;
  }
}

/// At most as many as are told, and as Gaze lets everything have at last; none where there are few anyway.
void expect_voxels(const Detail& detail, const std::string& bytes) {
  constexpr std::uint32_t few = 24;
  const Decoded finest(bytes);
  EXPECT_EQ(detail.triangles_of_voxels.empty(), finest.whole("triangles").size() / 3 <= few);
  if (detail.triangles_of_voxels.empty()) return;
  EXPECT_LE(detail.triangles_of_voxels.back(), few);
  const char* counts = finest.header["kind"] == "piece" ? "ofFace" : "ofCell";
  for (std::size_t above = 0; above < detail.triangles_of_voxels.size(); ++above) {
    const int exponent = detail.finest_voxels + static_cast<int>(above);
    const std::string made = coarser(bytes, Detail::voxels + exponent);
    EXPECT_EQ(made, coarser(bytes, Detail::voxels + exponent));
    const Decoded hull(made);
    EXPECT_TRUE(hull.header["voxels"]);
    const auto triangles = triangles_of(hull, counts, counts[2] == 'F' ? "areas" : "volumes");
    // But for slivers that one way of cutting has, and another one not.
    EXPECT_LE(triangles.size(), 24 + 1.02 * detail.triangles_of_voxels[above]);
    EXPECT_GT(triangles.size(), 0U);
    EXPECT_LE(hull.whole(counts).size(), finest.whole(counts).size());
    for (const Point& point : hull.points())
      for (std::size_t k = 0; k < 3; ++k) {
        const double step = hull.header["step"];
        EXPECT_GE(point[k], detail.lower[k] - step);
        EXPECT_LE(point[k], detail.upper[k] + step);
      }
  }
  EXPECT_EQ(detail.voxels_with(1e9, detail.finest_voxels), Detail::voxels + detail.finest_voxels);
  EXPECT_EQ(detail.voxels_with(0, detail.finest_voxels),
            Detail::voxels + detail.finest_voxels + static_cast<int>(detail.triangles_of_voxels.size()) - 1);
}

/// What is told of a message without making its levels.
TEST(Levels, TellHowManyTrianglesTheyHave) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(3); ++round) {
    const auto result = evaluated(random_model(random));
    for (const std::size_t most : {std::size_t{1} << 30, std::size_t{200}}) {
      Scene scene;
      for (const std::string& bytes : surface_messages(3, *result.faces, most))
        put_detailed(scene, std::to_string(scene.size()), bytes);
      for (const auto& [number, detail] : scene.detailed()) {
        const std::string bytes = *scene.find(number)->bytes;
        ASSERT_FALSE(detail->triangles.empty());
        for (std::size_t above = 0; above < detail->triangles.size(); ++above) {
          const int level = detail->finest + static_cast<int>(above);
          const Decoded made(coarser(bytes, level));
          ASSERT_EQ(detail->triangles[above], made.whole("triangles").size() / 3) << "level " << level;
        }
        expect_voxels(*detail, bytes);
      }
    }
  }
}

/// A camera that looks along -z from above, with 90 degrees from low to high, as pages tell it.
std::string gaze_from(const Point& eye, double height, const json& more = json::object()) {
  constexpr double near = 0.1, far = 1e5;
  json said{{"gaze", 1},
            {"height", height},
            {"matrix",
             {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -(far + near) / (far - near), -1, -eye[0], -eye[1],
              (eye[2] * (far + near) - 2 * far * near) / (far - near), eye[2]}}};
  said.update(more);
  return said.dump();
}

Detail small_box(const Point& at) {
  Detail detail{.kind = Detail::Kind::cells, .run = 1, .lower = at, .upper = at};
  for (double& x : detail.upper) x += 0.5;
  detail.finest = -20;
  detail.coarsest = -4;
  detail.whole = 10;
  return detail;
}

TEST(Gaze, StepsAreAtMostHalfAPixelAndNotLessThanAQuarter) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  int seen = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    const double height = 100 + 2000 * unit(random);
    const Point eye{0, 0, 1 + 100 * unit(random)};
    const auto gaze = Gaze::heard(gaze_from(eye, height));
    ASSERT_TRUE(gaze);
    Detail detail =
        small_box({200 * (unit(random) - 0.5), 200 * (unit(random) - 0.5), -1 - 20 * unit(random)});
    detail.coarsest = 4;
    const auto wanted = gaze->wanted(detail, 0);
    const double distance = eye[2] - detail.upper[2], farthest = eye[2] - detail.lower[2];
    const auto is_beyond = [&](std::size_t axis) {  // at each depth the picture is as wide as that is away
      return detail.lower[axis] > farthest || detail.upper[axis] < -farthest;
    };
    if (is_beyond(0) || is_beyond(1)) {
      EXPECT_FALSE(wanted.is_seen);
      EXPECT_EQ(wanted.level, detail.coarsest);
      continue;
    }
    ASSERT_TRUE(wanted.is_seen);
    ++seen;
    const double pixel = 2 * distance / height, step = std::exp2(wanted.level);
    EXPECT_LE(step, 0.5000001 * pixel);
    EXPECT_GT(step, 0.2499999 * pixel);
  }
  EXPECT_GT(seen, samples::rounds(2000) / 20);
}

/// Falling numbers from one on, for levels after each other.
std::vector<std::uint32_t> falling(std::mt19937& random, double from, std::uint32_t least) {
  std::vector<std::uint32_t> counts;
  for (double left = from; left >= least; left *= std::uniform_real_distribution<double>(0, 1)(random))
    counts.push_back(static_cast<std::uint32_t>(left));
  if (least > 0) counts.push_back(least);
  return counts;
}

/// Nothing has more triangles than twice the pixels around it, or two boxes; nothing is lost; and nothing is
/// coarser than it need be for that.
TEST(Gaze, NothingHasManyMoreTrianglesThanPixels) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::map<std::string, int> kinds;
  for (int round = 0; round < std::max(1000, samples::rounds(1000)); ++round) {  // one in a hundred is rare
    const double height = 100 + 2000 * unit(random);
    const Point eye{0, 0, 50 + 200 * unit(random)};
    Detail detail = small_box({20 * (unit(random) - 0.5), 20 * (unit(random) - 0.5), 0});
    detail.triangles.resize(12 + random() % 8, 1U + static_cast<std::uint32_t>(1e5 * unit(random)));
    for (const auto more : falling(random, detail.triangles.back(), 1)) detail.triangles.push_back(more);
    detail.whole = detail.finest + static_cast<int>(detail.triangles.size() - 1 - random() % 5);
    detail.finest_voxels = detail.finest + static_cast<int>(random() % 12);
    detail.triangles_of_voxels = falling(random, 1e5 * unit(random), 12);
    const auto gaze = Gaze::heard(gaze_from(eye, height)).value();
    const auto wanted = gaze.wanted(detail, 0);
    std::array<double, 2> low{1e9, 1e9},
        high{-1e9, -1e9};  // pixels: at each depth the picture is twice as wide as that
    for (const double z : {detail.lower[2], detail.upper[2]})
      for (const std::size_t axis : {0, 1})
        for (const double at : {detail.lower[axis], detail.upper[axis]}) {
          low[axis] = std::min(low[axis], at / (eye[2] - z) * height / 2);
          high[axis] = std::max(high[axis], at / (eye[2] - z) * height / 2);
        }
    const double most = std::max(24.0, 2 * std::max(1.0, high[0] - low[0]) * std::max(1.0, high[1] - low[1]));
    const double pixel = 2 * (eye[2] - detail.upper[2]) / height;
    ASSERT_TRUE(wanted.is_seen);
    if (Detail::is_of_voxels(wanted.level)) {
      const int exponent = wanted.level - Detail::voxels, above = exponent - detail.finest_voxels;
      EXPECT_LE(detail.triangles_of_voxels.at(static_cast<std::size_t>(above)), 1.001 * most);
      const bool is_last = above == static_cast<int>(detail.triangles_of_voxels.size()) - 1;
      EXPECT_TRUE(is_last || std::exp2(exponent) > 0.4999 * pixel);
      for (int level = detail.finest; level <= detail.whole; ++level)  // no other would do
        EXPECT_TRUE(detail.triangles_at(level) > 0.999 * most || std::exp2(level) > 1.0001 * pixel);
      kinds["voxels"] += 1;
    } else {
      EXPECT_LE(detail.triangles_at(wanted.level), 1.001 * most);
      EXPECT_LE(wanted.level, std::max(detail.whole, detail.finest));
      EXPECT_LE(std::exp2(wanted.level), 1.0001 * pixel);
      kinds[std::exp2(wanted.level) > 0.5001 * pixel ? "a pixel" : "half a pixel"] += 1;
    }
    // The same where it is moved, to before another eye.
    detail.part = 5;
    const Point shift{3 * unit(random), -2, 1},
        other{eye[0] + shift[0], eye[1] + shift[1], eye[2] + shift[2]};
    const auto moved = Gaze::heard(gaze_from(other, height)).value().wanted(detail, 0, shift);
    EXPECT_EQ(moved.level, wanted.level);
    // And where a plane takes a little of it away that is behind the rest; nothing is wanted where it takes
    // all.
    const double bottom = detail.lower[2], top = detail.upper[2];
    for (const auto& [at, side] : {std::pair((bottom + top) / 2, 1), {top + 1, 1}, {bottom - 1, -1}}) {
      const auto cut = Gaze::heard(gaze_from(eye, height, {{"planes", {{2, at, side}}}})).value();
      const bool is_away = at > top || at < bottom;
      EXPECT_EQ(cut.wanted(detail, 0).is_seen, !is_away);
      const int level = cut.wanted(detail, 0).level;
      if (!is_away) {
        EXPECT_EQ(level, wanted.level);
      } else if (Detail::is_of_voxels(level)) {
        const int above = level - Detail::voxels - detail.finest_voxels;
        EXPECT_LE(detail.triangles_of_voxels.at(static_cast<std::size_t>(above)), 1.001 * most);
      } else {
        EXPECT_EQ(level, detail.coarsest);
        EXPECT_LE(detail.triangles_at(level), 1.001 * most);
      }
    }
  }
  for (const char* kind : {"voxels", "a pixel", "half a pixel"}) EXPECT_GT(kinds[kind], 0) << kind;
}

TEST(Gaze, WhatIsNotDrawnIsNotWantedAndWhatIsSelectedIsWantedAsItIs) {
  Detail piece = small_box({0, 0, 0});
  piece.kind = Detail::Kind::surface;
  piece.part = 3;
  piece.number = 7;
  const Detail cells = small_box({0, 0, 0});
  const auto surface = Gaze::heard(gaze_from({0, 0, 50}, 500, {{"surface", true}})).value();
  EXPECT_EQ(surface.wanted(cells, 1).level, Detail::nothing);
  EXPECT_NE(surface.wanted(cells, 0).level, Detail::nothing) << "of a run that has no surface yet";
  EXPECT_TRUE(surface.wanted(piece, 1).is_seen);
  const auto without = Gaze::heard(gaze_from({0, 0, 50}, 500, {{"surface", true}, {"hidden", {3}}})).value();
  EXPECT_EQ(without.wanted(piece, 1).level, Detail::nothing);
  const auto picked = Gaze::heard(gaze_from({0, 0, 50}, 500, {{"surface", true}, {"pieces", {7}}})).value();
  EXPECT_EQ(picked.wanted(piece, 1).level, piece.finest);
  EXPECT_EQ(surface.wanted(piece, 1).level, picked.wanted(small_box({0, 0, 0}), 0).level);
  const auto inside = Gaze::heard(gaze_from({0, 0, 0.25}, 500)).value();
  EXPECT_EQ(inside.wanted(cells, 0).level, cells.finest);
}

TEST(Gaze, GarbageIsNone) {
  for (const std::string text :
       {"", "nothing", "[]", "{}", R"({"gaze":1})", R"({"gaze":1,"height":5,"matrix":[1,2]})",
        R"({"gaze":-1,"height":5,"matrix":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]})",
        R"({"gaze":1,"height":5,"matrix":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,"x"]})"})
    EXPECT_FALSE(Gaze::heard(text)) << text;
  const auto odd = Gaze::heard(
      R"({"gaze":1,"height":0,"matrix":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1],"hidden":7,"pieces":{},
          "explode":"far","middle":[1,2],"planes":[3,[],[3,1,1],[1,null,1],[1,2,1],[1,5,1],[0,-1,-1]]})");
  ASSERT_TRUE(odd);
  EXPECT_EQ(odd->explode, 0);
  EXPECT_EQ(odd->planes, (std::vector<Gaze::Plane>{{1, 2, true}, {0, -1, false}}));
  const int level = odd->wanted(small_box({0, 0, 0}), 0).level;
  EXPECT_TRUE(level >= -20 && level <= -4);
}

/// A scene whose messages tell their key and level.
class Reading : public ::testing::Test {
 protected:
  Scene scene_;
  Levels levels_{500};
  std::map<std::string, int> versions_;

  void put(const std::string& key, const Point& at) {
    const std::string name = key + "." + std::to_string(++versions_[key]);
    auto detail = std::make_shared<Detail>(small_box(at));
    detail->coarser = [](const std::string& bytes, int level) {
      return bytes.substr(0, bytes.find('@')) + told(level);
    };
    scene_.put(key, name + told(detail->finest), detail);
  }
  /// With less and less bytes behind it.
  static std::string told(int level) {
    return "@" + std::to_string(level) + std::string(size_of(level), ' ');
  }
  static std::size_t size_of(int level) { return std::size_t{1} << (-4 - level) / 2; }
  /// What a page has at last: of each key the version and level; "seen" if it is told that this is all.
  std::map<std::string, std::string> read(Reader& reader, std::map<std::string, std::string> has) {
    while (const auto next = reader.next()) {
      has["seen"] = next->is_text ? *next->bytes : "";
      const std::string& bytes = *next->bytes;
      if (!next->is_text) has[bytes.substr(0, bytes.find('.'))] = bytes.substr(bytes.find('.') + 1);
      EXPECT_LE(levels_.bytes(), 500U);
    }
    return has;
  }
};

TEST_F(Reading, APageHasEachThingAtItsLevelAtLastWhateverCameBefore) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-40, 40), height(1, 100);
  std::map<std::string, Point> at;
  // One that keeps nothing that is much finer than it sees, and one that does.
  Reader strict(scene_, levels_, true, 0), other(scene_, levels_, true), program(scene_, levels_, false);
  std::map<std::string, std::string> has, other_has, program_has;
  for (int round = 0; round < samples::rounds(100); ++round) {
    for (unsigned i = random() % 6; i > 0; --i) {
      const std::string key = "k" + std::to_string(random() % 20);
      at[key] = {place(random), place(random), place(random) / 10};
      put(key, at[key]);
    }
    const auto gaze =
        Gaze::heard(gaze_from({place(random), place(random), 5 + height(random)}, 100 + random() % 900))
            .value();
    strict.look(gaze);
    other.look(gaze);
    has = read(strict, has);
    other_has = read(other, other_has);
    program_has = read(program, program_has);
    EXPECT_EQ(has["seen"], R"({"seen":1})");
    EXPECT_FALSE(strict.next());
    for (const auto& [key, place_of_key] : at) {
      const std::string version = std::to_string(versions_[key]) + "@";
      const auto wanted = gaze.wanted(small_box(place_of_key), 0);
      EXPECT_EQ(program_has[key], std::to_string(versions_[key]) + told(-20)) << key;
      ASSERT_TRUE(has[key].starts_with(version) && other_has[key].starts_with(version)) << key;
      if (!wanted.is_seen) continue;
      const int held = std::stoi(has[key].substr(version.size()));
      EXPECT_LE(held, wanted.level) << key;
      EXPECT_LE(size_of(held), 2 * size_of(wanted.level) + 20) << key;
      EXPECT_LE(std::stoi(other_has[key].substr(version.size())), wanted.level) << key;
    }
  }
}

TEST_F(Reading, NothingThatHasLevelsComesBeforeAPageTellsWhereItLooks) {
  Reader reader(scene_, levels_, true);
  scene_.put_first("model", "model");
  put("k", {0, 0, 0});
  for (int i = 0; i < 2; ++i) ASSERT_EQ(*reader.next()->bytes, "model");  // before all, and in its place
  EXPECT_FALSE(reader.next());
  reader.look(Gaze::heard(gaze_from({0, 0, 50}, 500)).value());
  EXPECT_TRUE(reader.next()->bytes->starts_with("k.1@"));
}

TEST_F(Reading, APageThatStandsStillIsNotRememberedWithWhatIsGone) {
  Reader reader(scene_, levels_, true);
  reader.look(Gaze::heard(gaze_from({0, 0, 50}, 500)).value());
  for (int i = 0; i < 5000; ++i) {
    put("k" + std::to_string(i % 7), {0, 0, 0});
    while (reader.next()) {
    }
    ASSERT_LE(reader.held(), 1100U);
  }
}

/// A message at its own level, but for the opaque triangles of some parts, as it is read.
std::multiset<Triangle> triangles_without(const Decoded& message, const std::set<std::int64_t>& hidden) {
  const auto points = message.points();
  const auto corners = message.whole("triangles"), parts = message.whole("parts");
  const auto opaque = message.header["opaque"].get<std::size_t>();
  std::multiset<Triangle> all;
  for (std::size_t at = 0; at < corners.size(); at += 3)
    if (at >= 3 * opaque || !hidden.contains(parts.at(corners[at])))
      all.insert({points.at(corners[at]), points.at(corners[at + 1]), points.at(corners[at + 2])});
  return all;
}

/// Each region that a page has is without what is hidden now, and with all else; and it is bounded so, too.
TEST(Levels, CellsComeWithoutHiddenParts) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(3); ++round) {
    const auto result = evaluated(random_model(random));
    Scene scene;
    Levels levels;
    std::map<std::uint32_t, std::string> regions;
    for (const auto& batch : result.mesh.batches) {
      if (batch->empty() || regions.contains(batch->region.front())) continue;
      const std::uint32_t region = batch->region.front();
      std::vector<std::shared_ptr<const geometry::CellBatch>> own;
      for (const auto& other : result.mesh.batches)
        if (!other->empty() && other->region.front() == region) own.push_back(other);
      regions[region] = region_message(3, region, own, {}, 1U << 30);
      put_detailed(scene, std::to_string(region), regions[region]);
    }
    // From near all is as it is.
    Reader near(scene, levels, true), far(scene, levels, true);
    std::map<std::uint32_t, std::string> has;
    for (const std::set<std::int64_t>& hidden : {std::set<std::int64_t>{}, {1}, {0, 1}, {0}, {}}) {
      near.look(Gaze::heard(gaze_from({0, 0, 0}, 500, {{"hidden", hidden}})).value());
      while (const auto next = near.next())
        if (!next->is_text) has[Decoded(*next->bytes).header["region"]] = *next->bytes;
      for (const auto& [region, bytes] : regions)
        EXPECT_EQ(triangles_without(Decoded(has[region]), hidden), triangles_without(Decoded(bytes), hidden));
      far.look(Gaze::heard(gaze_from({0, 0, 50}, 10, {{"hidden", hidden}})).value());
      while (const auto next = far.next()) {
        if (next->is_text) continue;
        const Decoded message(*next->bytes);
        EXPECT_LE(message.whole("triangles").size() / 3, 400U);  // two of each pixel of the picture, and more
        EXPECT_EQ(triangles_without(message, {}), triangles_without(message, hidden));
      }
    }
  }
}

}  // namespace
}  // namespace bsp2::api
