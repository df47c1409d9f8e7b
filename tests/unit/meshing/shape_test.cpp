// Tetrahedra of good shape: of solids for which it is known what comes of them.

#include "simplices/shape.hpp"

#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/simplices/orientation.hpp"
#include "bsp2/meshing/tetrahedra/dual.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "dataflow/oracle.hpp"
#include "editing/editor.hpp"
#include "meshing/mesh_checks.hpp"
#include "support/rounds.hpp"

namespace bsp2::meshing {
namespace {

/// A cell about a point of an edge that leads inwards would have faces that are turned: it is divided.
TEST(Dual, HasNoFacesThatSolversRefuseWhereEdgesLeadInwards) {
  int divided = 0;
  std::size_t wrong = 0;
  for (int round = 0; round < samples::all_rounds(12); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto length = [&] { return dataflow::uniform(random, 0.5, 2); };
    const auto solid = solid_of(dataflow::l_shape(length(), length(), length()));
    Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    ShapeOptions options;
    options.size = dataflow::uniform(random, 0.3, 1.5);
    shape(mesh, options);
    check_dual(mesh);
    const Dual dual = dual_of(mesh, std::vector<std::int32_t>(mesh.triangles.size()));
    EXPECT_EQ(dual.wrong_faces, wrong_faces(dual.complex).size());
    wrong += dual.wrong_faces;
    divided += dual.complex.cells() > mesh.points.size();
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(divided, 0);
  EXPECT_EQ(wrong, 0U);
}

/// A thin box, many times turned by next to nothing: cells and gaps as thin as corners are rounded.
TEST(Shape, LayersThinnerThanRoundingAreMended) {
  std::uint64_t turned = 0;
  int refused = 0;
  for (int round = 0; round < samples::rounds(6); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<model::Expression> boxes;
    for (int i = 0; i < 4; ++i) {
      const double a = 0.3 + dataflow::pick(random, -2, 2) * std::ldexp(1, -dataflow::pick(random, 44, 50));
      const double shift = dataflow::pick(random, -2, 2) * std::ldexp(1, -dataflow::pick(random, 44, 50));
      const std::vector<double> turn{std::cos(a), -std::sin(a),
                                     0,           7 + shift,
                                     std::sin(a), std::cos(a),
                                     0,           5,
                                     0,           0,
                                     1,           shift,
                                     0,           0,
                                     0,           1};
      boxes.push_back(model::transform(turn, model::cuboid({2, 1, 1 + shift}, true)));
    }
    const auto solid = solid_of(model::unite(boxes), 1, 0);
    const Complex complex = conforming_complex(solid.network.table, solid.batches);
    if (complex.cells() == 0) continue;
    Tetrahedra mesh = tetrahedra_of(complex);
    const double area = solid.surface.area();
    const ShapeReport report = shape(mesh, {.clean = 1e-6, .size = round % 5 == 4 ? 1.0 : 0.0});
    turned += report.turned_at_first;
    if (report.turned > 0) {  // it is told: hardly ever, of one in some hundreds
      ++refused;
      continue;
    }
    EXPECT_LE(report.largest_move, 1e-6);
    check_tetrahedra(mesh, solid.volume, 1e-9 * (1 + solid.volume) + report.largest_move * area);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(turned, 0U);
  EXPECT_LE(refused, 1);
}

TEST(Orientation, IsThatOfFractions) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int flat = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    std::array<Point, 4> p;
    for (Point& point : p)
      for (double& x : point)
        x = dataflow::uniform(random, -1, 1) * std::ldexp(1, dataflow::pick(random, -30, 3));
    if (round % 2 == 0) {  // nearly or truly flat
      for (std::size_t k = 0; k < 3; ++k) {
        p[3][k] = p[0][k] + (p[1][k] - p[0][k]) / 2 + (p[2][k] - p[0][k]) / 4;
        if (round % 4 == 0) p[0][k] = p[1][k] = p[2][k] = 0.125 * dataflow::pick(random, -4, 4);
      }
    }
    const int sign = exact_sign(p[0], p[1], p[2], p[3]);
    flat += sign == 0 ? 1 : 0;
    ASSERT_EQ(orientation(p[0], p[1], p[2], p[3]), sign);
    ASSERT_EQ(orientation(p[1], p[0], p[2], p[3]), -sign);
  }
  EXPECT_GT(flat, 0);
}

TEST(Shape, ABlockOfOneSizeIsGood) {
  const std::vector<double> middle{1, 0, 0, 5, 0, 1, 0, 3, 0, 0, 1, -1, 0, 0, 0, 1};
  const auto hole = model::transform(middle, model::cylinder(4, 1, 1, 16, false));
  const auto solid = solid_of(model::subtract({model::cuboid({10, 6, 2}, false), hole}));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  shape(mesh, {.clean = 1e-6, .size = 1});
  check_tetrahedra(mesh, solid.volume, 1e-9 * solid.volume);
  const Quality quality = quality_of(mesh);
  EXPECT_GT(quality.smallest_angle, 8);
  EXPECT_EQ(quality.tetrahedra_below[2], 0U);
  EXPECT_GT(quality.mean_aspect, 0.5);
}

/// Tetrahedra around an edge, all around it or not: it is divided if that makes the worst of them better, and
/// in its middle if it is on the surface.
TEST(Editor, DividesEdgesWhereTheWorstBecomesBetter) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::array<std::array<int, 2>, 2> met{};  // by whether it is inside, and was divided
  for (int round = 0; round < samples::all_rounds(500); ++round) {
    const bool is_inside = dataflow::chance(random, 0.5);
    const int count = dataflow::pick(random, is_inside ? 4 : 1, 7);
    Tetrahedra mesh;
    mesh.points = {{0, 0, -dataflow::uniform(random, 0.6, 3)}, {0, 0, dataflow::uniform(random, 0.6, 3)}};
    const double step =
        is_inside ? 2 * std::numbers::pi / count : dataflow::uniform(random, 0.1, 5.0 / (count + 1));
    const int corners = is_inside ? count : count + 1;
    for (int i = 0; i < corners; ++i) {
      const double angle = i * step, far = dataflow::uniform(random, 0.5, 1.5);
      mesh.points.push_back(
          {far * std::cos(angle), far * std::sin(angle), dataflow::uniform(random, -0.2, 0.2)});
    }
    const auto corner = [&](int i) { return static_cast<std::uint32_t>(2 + i % corners); };
    for (int i = 0; i < count; ++i) mesh.tetrahedra.push_back({0, corner(i), corner(i + 1), 1});
    mesh.part.assign(mesh.tetrahedra.size(), 0);
    mesh.sides = {
        {0, 0, PlaneSide::nothing, {0, 0, 1}}};  // all on one: what counts is whether they are outer
    for (int i = 0; i < count; ++i)
      for (const std::uint32_t end : {0U, 1U}) {
        mesh.triangles.push_back(
            {end, corner(i + 1 - static_cast<int>(end)), corner(i + static_cast<int>(end))});
      }
    if (!is_inside) {
      mesh.triangles.push_back({0, corner(0), 1});
      mesh.triangles.push_back({1, corner(count), 0});
    }
    mesh.side.assign(mesh.triangles.size(), 0);
    const auto worst_of = [](const Tetrahedra& some) {
      double worst = 1;
      for (const auto& [a, b, c, d] : some.tetrahedra)
        worst = std::min(worst, shape_of(some.points[a], some.points[b], some.points[c], some.points[d]));
      return worst;
    };
    const double before = worst_of(mesh);
    ASSERT_GT(before, 0);
    Tetrahedra halved = mesh;
    halved.points.push_back({0, 0, (mesh.points[0][2] + mesh.points[1][2]) / 2});
    const auto middle = static_cast<std::uint32_t>(mesh.points.size());
    for (int i = 0; i < count; ++i) {
      halved.tetrahedra.push_back(halved.tetrahedra[static_cast<std::size_t>(i)]);
      halved.tetrahedra[static_cast<std::size_t>(i)][0] = middle;
      halved.tetrahedra.back()[3] = middle;
    }
    Editor editor(mesh);
    const bool is_divided = editor.split_better(0, 1);
    std::vector<std::uint32_t> map;
    const Tetrahedra after = editor.result(map);
    ++met[is_inside ? 1 : 0][is_divided ? 1 : 0];
    if (!is_inside) {
      ASSERT_EQ(is_divided, worst_of(halved) > before);
    } else if (worst_of(halved) > before) {
      ASSERT_TRUE(is_divided);
    }
    ASSERT_EQ(after.tetrahedra.size(), mesh.tetrahedra.size() * (is_divided ? 2 : 1));
    if (is_divided) {
      ASSERT_GT(worst_of(after), before);
    }
    if (is_divided && !is_inside) {
      ASSERT_NEAR(after.points.back()[2], halved.points.back()[2], 1e-15);
    }
  }
  for (const auto& of : met)
    for (const int times : of) EXPECT_GT(times, 0);
}

/// Four tetrahedra around a point in a large one: where it is near to a face it goes there, and divides it.
TEST(Editor, PointsNearToAnOuterFaceDivideIt) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::array<int, 2> met{};  // by whether it was divided
  for (int round = 0; round < samples::all_rounds(500); ++round) {
    Tetrahedra mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, 1}};
    for (std::size_t p = 0; p < 4; ++p)
      for (double& x : mesh.points[p]) x += dataflow::uniform(random, -0.1, 0.1);
    std::array<double, 4> weight;
    for (double& w : weight) w = dataflow::uniform(random, 0.1, 1);
    weight[3] *= dataflow::chance(random, 0.7) ? 1e-3 : 1;
    const double sum = weight[0] + weight[1] + weight[2] + weight[3];
    Point inside{};
    for (std::size_t p = 0; p < 4; ++p)
      for (std::size_t k = 0; k < 3; ++k) inside[k] += weight[p] / sum * mesh.points[p][k];
    mesh.points.push_back(inside);
    mesh.tetrahedra = {{0, 1, 2, 4}, {0, 3, 1, 4}, {1, 3, 2, 4}, {2, 3, 0, 4}};
    mesh.part.assign(4, 0);
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    mesh.side = {0, 1, 2, 3};
    for (std::uint32_t i = 0; i < 4; ++i) mesh.sides.push_back({i, 0, PlaneSide::nothing, {}});
    for (std::uint32_t i = 0; i < 4; ++i) {
      const auto& [a, b, c] = mesh.triangles[i];
      mesh.sides[i].outward = cross(mesh.points[b] - mesh.points[a], mesh.points[c] - mesh.points[a]);
    }
    const double volume = volumes_of(mesh, 1)[0];
    const double least = dataflow::uniform(random, 0, 0.3);
    Editor editor(mesh);
    const bool is_divided = editor.divide_face(0, least);
    std::vector<std::uint32_t> map;
    const Tetrahedra after = editor.result(map);
    ++met[is_divided ? 1 : 0];
    ASSERT_EQ(after.tetrahedra.size(), is_divided ? 3U : 4U);
    ASSERT_EQ(after.triangles.size(), is_divided ? 6U : 4U);
    ASSERT_NEAR(volumes_of(after, 1)[0], volume, 1e-14);
    const FaceUse use = face_use(after);
    ASSERT_EQ(use.more + use.folded + use.strange, 0U);
    double worst = 1;
    for (const auto& [a, b, c, d] : after.tetrahedra)
      worst = std::min(worst, shape_of(after.points[a], after.points[b], after.points[c], after.points[d]));
    if (is_divided) {
      ASSERT_GE(worst, least);
    } else {
      ASSERT_EQ(after.points, mesh.points);
    }
  }
  EXPECT_GT(met[0], 0);
  EXPECT_GT(met[1], 0);
}

/// The side of a cylinder of facets becomes round: nearly all points come to where they belong.
TEST(Shape, PointsGoToTheirTruePlace) {
  const auto solid = solid_of(model::cylinder(2, 1, 1, 12, false));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  ShapeOptions options{.clean = 1e-6, .size = 0.2};
  options.true_place = [&](std::span<const std::uint32_t>, const Point& p) -> std::optional<Point> {
    const double r = std::hypot(p[0], p[1]);
    if (r < 0.9) return std::nullopt;  // within the lids
    return Point{p[0] / r, p[1] / r, p[2]};
  };
  const ShapeReport report = shape(mesh, options);
  EXPECT_GT(report.placed, 0U);
  EXPECT_LE(report.largest_placing, 1 - std::cos(std::numbers::pi / 12) + 1e-12);
  check_tetrahedra(mesh, std::numbers::pi * 2, 0.1);
  double volume = 0;
  for (const double content : volumes_of(mesh, 0)) volume += content;
  EXPECT_GT(volume, solid.volume * 1.02) << "rounder than the facets";
  std::size_t on_side = 0, there = 0;
  for (const Point& p : mesh.points) {
    const double r = std::hypot(p[0], p[1]);
    if (r < 0.97) continue;
    ++on_side;
    there += std::fabs(r - 1) < 1e-12 ? 1 : 0;
  }
  EXPECT_GT(there, on_side * 95 / 100);
}

/// Runs a phase that is asked to end at the n-th question. @return how often it asked, or 0 if it did end.
template <typename Phase>
std::uint64_t questions(std::uint64_t n, const Phase& phase) {
  std::uint64_t asked = 0;
  const geometry::Interruption stop([&] { return ++asked == n; }, std::chrono::milliseconds(0));
  try {
    phase();
  } catch (const geometry::Interrupted&) {
    EXPECT_EQ(asked, n);
    return 0;
  }
  return asked;
}

/// Each phase asks for each thing that it goes through, and ends at whichever question it is told to.
TEST(Interruption, EndsEachPhase) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const auto place = model::cuboid({2, 2, 2}, true);  // so that it is not empty
  const auto solid = solid_of(model::unite({place, random_solid(random, Kind::solids)}));
  const Complex complex = conforming_complex(solid.network.table, solid.batches);
  const Tetrahedra mesh = tetrahedra_of(complex);
  const auto check = [&](const char* name, std::size_t things, const auto& phase) {
    SCOPED_TRACE(name);
    const std::uint64_t all = questions(0, phase);
    EXPECT_GE(all, things);
    ASSERT_GT(all, 0U);
    EXPECT_EQ(questions(1 + random() % all, phase), 0U);
  };
  check("complex", complex.faces(), [&] { (void)conforming_complex(solid.network.table, solid.batches); });
  check("cones", complex.faces() + complex.cells(), [&] { (void)tetrahedra_of(complex); });
  check("quality", mesh.tetrahedra.size(), [&] { (void)quality_of(mesh); });
  for (const double size : {0.0, 1.0})
    check("shape", mesh.tetrahedra.size(), [&] {
      Tetrahedra copy = mesh;
      (void)shape(copy, {.clean = 1e-6, .size = size});
    });
  check("cells", 2 * mesh.tetrahedra.size(), [&] {
    std::vector<std::uint32_t> triangles;
    (void)complex_of(mesh, triangles);
  });
}

double own_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// No long work goes on without a question: by time of this thread, which does not pass while others work.
TEST(Interruption, IsAskedForAllTheTime) {
  const auto solid =
      solid_of(model::subtract({model::cuboid({10, 6, 2}, false), model::cylinder(9, 3, 3, 24, false)}));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  const double begin = own_seconds();
  double last = begin, longest = 0;
  const auto note = [&] {
    const double now = own_seconds();
    longest = std::max(longest, now - last);
    last = now;
    return false;
  };
  const geometry::Interruption stop(note, std::chrono::milliseconds(0));
  shape(mesh, {.clean = 1e-6, .size = 0.5});
  note();
  EXPECT_LT(longest, (last - begin) / 4);
}

TEST(SizeField, IsThatOfTheNearestPoint) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  EXPECT_EQ(SizeField().at({1, 2, 3}), std::numeric_limits<double>::infinity());
  for (int round = 0; round < samples::rounds(50); ++round) {
    std::vector<SizeField::Entry> entries;
    const auto place = [&]() -> Point {  // on a grid, so that several are as near, or the same
      return {1.0 * dataflow::pick(random, -3, 3), 1.0 * dataflow::pick(random, -3, 3),
              0.5 * dataflow::pick(random, -3, 3)};
    };
    for (int i = dataflow::pick(random, 1, 60); i > 0; --i)
      entries.push_back({place(), 0.125 * dataflow::pick(random, 1, 9)});
    const SizeField field(entries);
    for (int i = 0; i < 20; ++i) {
      const Point at = place();
      std::pair<double, double> nearest{1e300, 0};
      for (const auto& [p, size] : entries) {
        double squared = 0;
        for (std::size_t k = 0; k < 3; ++k) squared += (p[k] - at[k]) * (p[k] - at[k]);
        nearest = std::min(nearest, {squared, size});
      }
      ASSERT_EQ(field.at(at), nearest.second);
    }
  }
}

TEST(Shape, EdgesAreAsLongAsTheFieldSays) {
  const auto solid = solid_of(model::cuboid({8, 2, 2}, false));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  const SizeField field({{{0, 1, 1}, 0.4}, {{8, 1, 1}, 1.0}});
  shape(mesh, {.clean = 1e-6, .size = 1, .field = field});
  check_tetrahedra(mesh, solid.volume, 1e-9 * solid.volume);
  std::array<double, 2> sum{};
  std::array<int, 2> count{};
  for (const auto& t : mesh.tetrahedra) {
    const Point &a = mesh.points[t[0]], &b = mesh.points[t[1]];
    if (std::fabs(a[0] - 4) < 2.5) continue;  // in between, where sizes go over
    sum[a[0] > 4] += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    ++count[a[0] > 4];
  }
  EXPECT_NEAR(sum[0] / count[0], 0.4, 0.15);
  EXPECT_NEAR(sum[1] / count[1], 1.0, 0.35);
}

}  // namespace
}  // namespace bsp2::meshing
