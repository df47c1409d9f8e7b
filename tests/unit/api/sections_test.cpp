#include "viewer/sections.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "support/rounds.hpp"
#include "viewed.hpp"
#include "viewer/levels.hpp"
#include "viewer/packing.hpp"

namespace bsp2::api {
namespace {

using nlohmann::json;
using Flat = std::array<double, 2>;

bool contains(const Trapezoid& each, const Flat& point) {
  if (point[1] < each.low || point[1] >= each.high) return false;
  const double share = (point[1] - each.low) / (each.high - each.low);
  const auto at = [&](const Flat& ends) { return ends[0] + share * (ends[1] - ends[0]); };
  return at(each.left) <= point[0] && point[0] < at(each.right);
}

double area_of(const std::vector<Trapezoid>& all) {
  double area = 0;
  for (const Trapezoid& each : all)
    area += (each.high - each.low) * (each.right[0] - each.left[0] + each.right[1] - each.left[1]) / 2;
  return area;
}

/// Half of the sum of cross products: what edges go around, counter-clockwise.
double area_of(const std::vector<FigureEdge>& edges) {
  double area = 0;
  for (const auto& [from, to] : edges) area += (from[0] * to[1] - from[1] * to[0]) / 2;
  return area;
}

/// Once around a place, as a star; the other way around it is a hole.
void add_star(std::vector<FigureEdge>& edges, std::mt19937& random, const Flat& middle, double low,
              double high, bool is_hole) {
  std::uniform_real_distribution<double> radius(low, high);
  const int count = 3 + static_cast<int>(random() % 9);
  std::vector<Flat> corners;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count, r = radius(random);
    corners.push_back({middle[0] + r * std::cos(angle), middle[1] + r * std::sin(angle)});
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Flat &from = corners[i], &to = corners[(i + 1) % corners.size()];
    edges.push_back(is_hole ? FigureEdge{to, from} : FigureEdge{from, to});
  }
}

/// Stars beside each other, some with a hole in them.
std::vector<FigureEdge> random_figure(std::mt19937& random) {
  std::vector<FigureEdge> edges;
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y) {
      if (random() % 4 == 0) continue;
      const Flat middle{x + 0.1, y + 0.2};
      add_star(edges, random, middle, 0.3, 0.5, false);
      if (random() % 2 == 0) add_star(edges, random, middle, 0.02, 0.14, true);
    }
  std::shuffle(edges.begin(), edges.end(), random);
  return edges;
}

/// How often edges are crossed from a point to the right.
bool is_in(const std::vector<FigureEdge>& edges, const Flat& point) {
  bool is_in = false;
  for (const auto& [from, to] : edges) {
    if ((from[1] > point[1]) == (to[1] > point[1])) continue;
    const double at = from[0] + (to[0] - from[0]) * (point[1] - from[1]) / (to[1] - from[1]);
    is_in = is_in != (at > point[0]);
  }
  return is_in;
}

TEST(Sections, FiguresAreFilledWhereTheirEdgesGoAroundAPlace) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-1, 5);
  for (int round = 0; round < samples::rounds(30); ++round) {
    const auto edges = random_figure(random);
    const auto all = filled(edges);
    EXPECT_NEAR(area_of(all), area_of(edges), 1e-12 * (1 + area_of(edges)));
    for (int i = 0; i < 200; ++i) {
      const Flat point{place(random), place(random)};
      const auto count =
          std::count_if(all.begin(), all.end(), [&](const auto& each) { return contains(each, point); });
      EXPECT_EQ(count, is_in(edges, point) ? 1 : 0);
    }
    // On a lattice ends move by at most half a step along each axis.
    constexpr double step = 1.0 / 64;
    double length = 0;
    for (const auto& [from, to] : edges) length += std::hypot(from[0] - to[0], from[1] - to[1]);
    EXPECT_NEAR(area_of(filled(edges, step)), area_of(edges), step * length);
  }
}

/// Where two ends are farther apart than a double can say.
TEST(Sections, TheLargestNumbersAreFilledToo) {
  const double far = 0x1.8p1023;
  const std::vector<FigureEdge> edges{{{-far, -far}, {far, -far}},
                                      {{far, -far}, {far, far}},
                                      {{far, far}, {-far, 0}},
                                      {{-far, 0}, {-far, -far}}};
  const auto all = filled(edges);
  ASSERT_EQ(all.size(), 2U);
  for (const Trapezoid& each : all) {
    EXPECT_LT(each.low, each.high);
    for (const std::size_t end : {0U, 1U}) {
      EXPECT_GE(each.left[end], -far);
      EXPECT_LE(each.left[end], each.right[end]);
      EXPECT_LE(each.right[end], far);
    }
  }
}

TEST(Sections, ABoxIsOneTrapezoidAndItsHoleMakesFour) {
  const auto box = [](double low, double high) {
    return std::vector<FigureEdge>{{{low, low}, {high, low}},
                                   {{high, low}, {high, high}},
                                   {{high, high}, {low, high}},
                                   {{low, high}, {low, low}}};
  };
  auto edges = box(0, 4);
  EXPECT_EQ(filled(edges), (std::vector<Trapezoid>{{0, 4, {0, 0}, {4, 4}}}));
  for (const auto& [from, to] : box(1, 2)) edges.push_back({to, from});
  EXPECT_EQ(filled(edges).size(), 4U);
  EXPECT_DOUBLE_EQ(area_of(filled(edges)), 15);
  EXPECT_TRUE(filled(box(0.1, 0.2), 1).empty());
  EXPECT_TRUE(filled({}).empty());
}

/// The part of the cell at a point; nothing where there is none. @param near whether it is near to a facet.
std::optional<std::int32_t> part_at(const supersteps::RunResult& result, const Point& point, bool& near) {
  for (const auto& batch : result.mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      if (batch->label[cell] != geometry::Label::in) continue;
      const double* points = batch->cell_points(cell).data();
      const std::size_t count = batch->point_count(cell);
      Point middle{};
      for (std::size_t v = 0; v < count; ++v)
        for (std::size_t i = 0; i < 3; ++i) middle[i] += points[3 * v + i] / static_cast<double>(count);
      double beyond = -1e300;
      for (std::size_t f = batch->facet_offset[cell]; f < batch->facet_offset[cell + 1]; ++f) {
        const auto corners = batch->vertices_of_facet(f);
        const double *a = points + 3 * corners[0], *b = points + 3 * corners[1], *c = points + 3 * corners[2];
        Point normal{};
        for (std::size_t i = 0; i < 3; ++i) {
          const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
          normal[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
        }
        double length = 0, own = 0, other = 0;
        for (std::size_t i = 0; i < 3; ++i) {
          length += normal[i] * normal[i];
          own += normal[i] * (middle[i] - a[i]);
          other += normal[i] * (point[i] - a[i]);
        }
        beyond = std::max(beyond, (own > 0 ? -other : other) / std::sqrt(length));
      }
      near = near || std::abs(beyond) < 2e-3;
      if (beyond < 0) return batch->part[cell];
    }
  return std::nullopt;
}

/// The middle of the corners of the largest of some cells.
Point point_of_large_cell(const supersteps::RunResult& result, std::mt19937& random) {
  double most = 0;
  Point middle{};
  for (int i = 0; i < 40; ++i) {
    const auto& batch = *result.mesh.batches[random() % result.mesh.batches.size()];
    if (batch.empty()) continue;
    const std::size_t cell = random() % batch.size();
    if (batch.volume[cell] <= most) continue;
    most = batch.volume[cell];
    middle = {};
    const std::size_t count = batch.point_count(cell);
    for (std::size_t v = 0; v < 3 * count; ++v)
      middle[v % 3] += batch.cell_points(cell)[v] / static_cast<double>(count);
  }
  return middle;
}

/// A scene of a result: its surface, and its cells.
void put_all(Scene& scene, const supersteps::RunResult& result) {
  std::map<std::uint32_t, std::vector<std::shared_ptr<const geometry::CellBatch>>> regions;
  for (const auto& batch : result.mesh.batches)
    if (!batch->empty()) regions[batch->region.front()].push_back(batch);
  for (const auto& [region, batches] : regions)
    put_detailed(scene, "region " + std::to_string(region), region_message(3, region, batches, {}, 1U << 30));
  std::size_t number = 0;
  for (std::string& piece : surface_messages(3, *result.faces, 1U << 30))
    put_detailed(scene, "piece " + std::to_string(number++), std::move(piece));
}

/// Trapezoids of a message, by whose they are: part, and region.
std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Trapezoid>> trapezoids_of(
    const Decoded& message) {
  const auto corners = message.real("corners");
  const auto counts = message.whole("counts"), parts = message.whole("parts"),
             regions = message.whole("regions");
  const std::size_t u = (message.header["axis"].get<std::size_t>() + 1) % 3, v = (u + 1) % 3;
  const Point middle = message.header["middle"];
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Trapezoid>> all;
  std::size_t at = 0;
  for (std::size_t i = 0; i < counts.size(); ++i)
    for (std::int64_t k = 0; k < counts[i]; ++k, at += 8) {
      EXPECT_EQ(corners.at(at + 1), corners.at(at + 3));
      EXPECT_EQ(corners.at(at + 5), corners.at(at + 7));
      all[{parts.at(i), regions.empty() ? 0 : regions.at(i)}].push_back(
          {corners[at + 1] + middle[v],
           corners[at + 5] + middle[v],
           {corners[at] + middle[u], corners[at + 6] + middle[u]},
           {corners[at + 2] + middle[u], corners[at + 4] + middle[u]}});
    }
  EXPECT_EQ(at, corners.size());
  return all;
}

/// From the eye that looks along -z from (0, 0, 60), in a picture of so many pixels.
Gaze gaze_with(double height, const json& more) {
  constexpr double near = 0.1, far = 1e5;
  json said{{"gaze", 1},
            {"height", height},
            {"middle", {0.5, -1, 2}},
            {"matrix",
             {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -(far + near) / (far - near), -1, 0, 0,
              (60 * (far + near) - 2 * far * near) / (far - near), 60}}};
  said.update(more);
  return Gaze::heard(said.dump()).value();
}

TEST(Sections, AreFilledWhereCellsOfThePartAre) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-12, 12);
  int found = 0;
  for (int round = 0; round < samples::rounds(4); ++round) {
    const auto result = evaluated(random_model(random));
    Scene scene;
    put_all(scene, result);
    for (const bool is_surface : {true, false}) {
      const auto axis = static_cast<std::size_t>(random() % 3);
      const Point inside = point_of_large_cell(result, random);
      const double at = inside[axis];
      const std::set<int> hidden =
          random() % 2 == 0 ? std::set<int>{} : std::set<int>{static_cast<int>(random() % 2)};
      const Gaze gaze =
          gaze_with(800, {{"surface", is_surface}, {"planes", {{axis, at, 1}}}, {"hidden", hidden}});
      std::uint64_t state = 0;
      const auto bytes = section_of(scene, gaze, 0, state);
      ASSERT_TRUE(bytes);
      EXPECT_FALSE(section_of(scene, gaze, 0, state)) << "the page has it";
      const Decoded message(*bytes);
      EXPECT_EQ(message.header["surface"], is_surface);
      EXPECT_EQ(message.header["at"], at);
      const auto all = trapezoids_of(message);
      for (int i = 0; i < 150; ++i) {
        Point point = i == 0 ? inside : Point{place(random), place(random), place(random)};
        point[axis] = at;
        bool near = false;
        const auto part = part_at(result, point, near);
        if (near) continue;
        std::multiset<std::int64_t> parts;
        for (const auto& [name, trapezoids] : all)
          for (const Trapezoid& each : trapezoids)
            if (contains(each, {point[(axis + 1) % 3], point[(axis + 2) % 3]})) parts.insert(name.first);
        std::multiset<std::int64_t> expected;
        if (part && !hidden.contains(*part)) expected.insert(*part);
        EXPECT_EQ(parts, expected);
        found += part ? 1 : 0;
      }
    }
  }
  EXPECT_GT(found, 0);
}

/// Where it is small in the picture it has few triangles, and where it is exploded the plane cuts what is
/// moved under it.
TEST(Sections, HaveNoMoreThanThePictureShowsAndFollowWhatIsMoved) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::string crowd;
  std::uniform_real_distribution<double> place(-9, 9);
  for (int i = 0; i < 1500; ++i) {
    std::ostringstream cube;
    cube << "multmatrix([[0.8, -0.6, 0, " << place(random) << "], [0.6, 0.8, 0, " << place(random)
         << "], [0, 0, 1, " << place(random) / 10 << "], [0, 0, 0, 1]]) cube(0.2, center = true);\n";
    crowd += cube.str();
  }
  const auto result = evaluated(crowd);
  Scene scene;
  put_all(scene, result);
  std::size_t before = 0;
  for (const double height : {4000.0, 100.0, 20.0, 2.0}) {
    for (const bool is_surface : {true, false}) {
      std::uint64_t state = 0;
      const Gaze gaze = gaze_with(height, {{"surface", is_surface}, {"planes", {{2, 0.01, -1}}}});
      const auto all = trapezoids_of(Decoded(*section_of(scene, gaze, 0, state)));
      std::size_t count = 0;
      for (const auto& [name, trapezoids] : all) count += trapezoids.size();
      if (!is_surface) continue;
      const double side = 20 / 60.0 * height / 2 * 1.05 + 1;  // pixels
      EXPECT_LE(static_cast<double>(count), std::max(12.0, side * side)) << height;
      EXPECT_TRUE(before == 0 || count <= std::max<std::size_t>(before, 12));
      before = count;
    }
  }
  // Two boxes in two parts, apart along z: the plane meets one of them as they lie, and none or the other one
  // where they are moved.
  const auto two = evaluated(
      "part(\"low\") cube([2, 2, 2]);\npart(\"high\") multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,6],[0,0,0,1]]) "
      "cube([2, 2, 2]);\n");
  Scene apart;
  put_all(apart, two);
  const auto parts_at = [&](double at, double explode) {
    std::uint64_t state = 0;
    const Gaze gaze = gaze_with(
        500, {{"surface", true}, {"explode", explode}, {"middle", {1, 1, 4}}, {"planes", {{2, at, 1}}}});
    std::map<std::int64_t, double> areas;
    for (const auto& [name, all] : trapezoids_of(Decoded(*section_of(apart, gaze, 0, state))))
      areas[name.first] += area_of(all);
    return areas;
  };
  using Areas = std::map<std::int64_t, double>;
  EXPECT_EQ(parts_at(1, 0), (Areas{{0, 4.0}}));
  EXPECT_EQ(parts_at(7, 0), (Areas{{1, 4.0}}));
  EXPECT_EQ(parts_at(4, 0), Areas{});
  EXPECT_EQ(parts_at(1, 1), Areas{});  // 0 to 2 has become -3 to -1,
  EXPECT_EQ(parts_at(-2, 1), (Areas{{0, 4.0}}));
  EXPECT_EQ(parts_at(10, 1), (Areas{{1, 4.0}}));  // and 6 to 8 has become 9 to 11
}

}  // namespace
}  // namespace bsp2::api
