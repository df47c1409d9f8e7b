// Prisms over curved solids and sections of them: intervals that hold the truth, labels asked of an oracle,
// streams that refine.

#include <gtest/gtest.h>

#include <cmath>

#include "dataflow/any_dimension.hpp"
#include "dataflow/intervals.hpp"
#include "dataflow/producer_stream.hpp"
#include "producers/preimage_producer.hpp"

namespace bsp2::dataflow {
namespace {

/// The circle of this radius as a NURBS curve: half circles, by four control points each.
Expression nurbs_disk(double r) {
  const double h = std::sqrt(0.5);
  model::Spline::Piece piece{{2}, {{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}}, {}};
  for (const auto& [x, y, w] : {std::array{1., 0., 1.},
                                {1., 1., h},
                                {0., 1., 1.},
                                {-1., 1., h},
                                {-1., 0., 1.},
                                {-1., -1., h},
                                {0., -1., 1.},
                                {1., -1., h},
                                {1., 0., 1.}})
    piece.points.insert(piece.points.end(), {r * x, r * y, w});
  return model::spline(2, {piece});
}

/// A cube that is subdivided: a rounded one.
Expression rounded_cube() {
  model::SubdivisionSurface surface;
  for (int i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis) surface.points.push_back((i >> axis & 1) != 0 ? 1 : -1);
  surface.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return model::subdivision_surface(3, surface);
}

VolumeInterval interval_of(const Expression& e, double tolerance) { return volume_interval(e, tolerance); }

// --- prisms ---

TEST(Prisms, OfToriAndConesHaveTheirVolume) {
  expect_contains(interval_of(model::extrude(model::torus(2, 1), {3}), 0.5), 12 * pi * pi, 1.2);
  expect_contains(interval_of(model::extrude(model::cone(2, 1, 0), {1.5}), 0.15), pi, 0.8);
#if BSP2_DIMENSIONS > 4
  expect_contains(interval_of(model::extrude(model::cone(2, 1, 0.5), {1, 2}), 0.4),
                  2 * 2 * pi * (1 + 0.5 + 0.25) / 3, 1.5);
#endif
  expect_contains(interval_of(model::product({model::cuboid({0.5}), model::cone(1, 1, 0)}), 0.1), pi / 6,
                  0.8);
  expect_contains(interval_of(model::embed(model::torus(2, 1), 4, 0.5), 0.5), 2 * pi * pi, 1.2);
  // Of a difference, too: what is outside of a prism is the prism over what is outside.
  const auto half =
      model::subtract({model::torus(2, 1),
                       model::transform(std::vector<double>{1, 0, 0, -4, 0, 1, 0, -4, 0, 0, 1, 0, 0, 0, 0, 1},
                                        model::cuboid({8, 8, 2}))});
  expect_contains(interval_of(model::extrude(half, {1}), 0.5), 2 * pi * pi, 2.5);
}

TEST(Prisms, OfSplinesAndSubdivisionSurfacesHaveTheirVolume) {
  double before = 1e300;
  for (const double tolerance : {0.1, 0.03}) {
    const VolumeInterval now = interval_of(model::extrude(nurbs_disk(2), {3}), tolerance);
    expect_contains(now, 12 * pi, 0.5);
    EXPECT_LT(now.fuzzy, 0.5 * before);
    before = now.fuzzy;
  }
  const VolumeInterval cube = interval_of(rounded_cube(), 0.1),
                       prism = interval_of(model::extrude(rounded_cube(), {2}), 0.4);
  EXPECT_LE(prism.in, 2 * (cube.in + cube.fuzzy));
  EXPECT_GE(prism.in + prism.fuzzy, 2 * cube.in);
  EXPECT_GT(prism.in, 0.5 * cube.in);
}

/// All vectors of a plane curved solid and another one: each is asked.
TEST(Prisms, ProductsOfTwoCurvedSolids) {
  Seeded s;
  const auto disk = nurbs_disk(1), ring = model::subtract({model::ball(2, 1), model::ball(2, 0.5)});
  check_labels<4>(model::product({disk, ring}), 0.3, s.random, [&](const Point& x, Real margin) {
    const Real distance = std::hypot(x[0], x[1]) - 1;
    const Where other = where(ring, {x[2], x[3]}, margin);
    return Where{distance < 0 && other.inside, std::fabs(distance) < margin || other.doubtful};
  });
}

// --- sections ---

TEST(Sections, OfToriHaveTheirArea) {
  double before = 1e300;
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    // Across the axis: the ring between 2 - s and 2 + s, s^2 = 1 - 1/4. Along it: two disks.
    const VolumeInterval ring = interval_of(model::section(model::torus(2, 1), 2, 0.5), tolerance);
    expect_contains(ring, 8 * pi * std::sqrt(0.75), 0.3);
    EXPECT_LT(ring.fuzzy, 0.3 * before);
    EXPECT_LT(ring.fuzzy, tolerance * 8 * pi);
    before = ring.fuzzy;
    expect_contains(interval_of(model::section(model::torus(2, 1), 0, 0), tolerance), 2 * pi, 0.3);
  }
  EXPECT_EQ(interval_of(model::section(model::torus(2, 1), 2, 1.5), 0.01).in, 0);
}

/// Villarceau: a plane that touches a torus from both sides of its hole cuts it in two circles of radius R, R
/// - r beside the middle.
TEST(Sections, OfToriAtAnAngle) {
  Seeded s;
  const double tilt = std::asin(0.5);
  const std::vector<double> turn{std::cos(tilt), 0, -std::sin(tilt), 0, 0, 1, 0, 0,
                                 std::sin(tilt), 0, std::cos(tilt),  0, 0, 0, 0, 1};
  const auto torus = model::transform(turn, model::torus(2, 1));
  check_labels<2>(model::section(torus, 2, 0), 0.02, s.random, [&](const Point& x, Real margin) {
    return where(torus, {x[0], x[1], 0}, margin);
  });
  // Two disks of radius 2 around +-1, without their common lens twice: the section is where exactly one of
  // them is.
  const double lens = 2 * 4 * std::acos(0.5) - 0.5 * 2 * std::sqrt(4 * 4 - 4.0);
  expect_contains(interval_of(model::section(torus, 2, 0), 0.005), 2 * (4 * pi - lens), 0.05);
  const auto free = model::transform(free_matrix(s.random, 3, 0.3), model::torus(2, 0.7));
  check_labels<2>(model::section(free, 1, 0.2), 0.05, s.random, [&](const Point& x, Real margin) {
    return where(free, {x[0], 0.2, x[1]}, margin);
  });
}

TEST(Sections, OfConesAndCylindersAtAnAngle) {
  Seeded s;
  // A cylinder cut at 45 degrees: an ellipse, sqrt(2) times as long as wide; in the plane of x and y as seen
  // from above, a disk.
  const double h = std::sqrt(0.5);
  const auto rod =
      model::transform(std::vector<double>{h, 0, h, -2 * h, 0, 1, 0, 0, -h, 0, h, -2 * h, 0, 0, 0, 1},
                       model::round_cylinder(2, 1, {4}));
  expect_contains(interval_of(model::section(rod, 2, 0), 0.01), pi * std::sqrt(2), 0.05);
  // A cone along its axis, through the middle and beside it: a triangle, and a hyperbola: the integral of 2
  // sqrt(r^2 - c^2), r = 1 - z / 2.
  const auto cone = model::cone(2, 1, 0);
  expect_contains(interval_of(model::section(cone, 0, 0), 0.01), 2, 0.05);
  const double c = 0.5, hyperbola = 4 * (0.5 * std::sqrt(1 - c * c) -
                                         c * c / 2 * std::log((1 + std::sqrt(1 - c * c)) / c));
  expect_contains(interval_of(model::section(cone, 0, c), 0.005), hyperbola, 0.1);
  for (int round = 0; round < 3; ++round) {
    const auto matrix = free_matrix(s.random, 3, 0.2);
    const auto solid = model::subtract({model::transform(matrix, model::cone(3, 2, 1)),
                                        model::transform(matrix, model::round_cylinder(2, 0.8, {2}))});
    const double at = matrix[11] + uniform(s.random, -0.3, 0.8);
    const auto cut = model::section(solid, 2, at);
    if (interval_of(cut, 0.1).in == 0) continue;
    check_labels<2>(cut, 0.05, s.random, [&](const Point& x, Real margin) {
      return where(solid, {x[0], x[1], at}, margin);
    });
  }
  const auto high = model::transform(free_matrix(s.random, 4, 0),
                                     model::round_cylinder(3, 1, {2}));  // in space, at an angle
  const auto cut = model::section(high, 3, 0.1);
  if (interval_of(cut, 0.2).in > 0)
    check_labels<3>(cut, 0.1, s.random, [&](const Point& x, Real margin) {
      return where(high, {x[0], x[1], x[2], 0.1}, margin);
    });
}

TEST(Sections, OfSplinesAndSubdivisionSurfaces) {
  expect_contains(interval_of(model::section(nurbs_disk(2), 0, 1), 0.01), 2 * std::sqrt(3.0), 0.05);
  // Of a rounded cube: less than what its control points span, the same through all faces; the sum of slices
  // is the volume.
  const VolumeInterval whole = interval_of(rounded_cube(), 0.1);
  double low = 0, high = 0;
  for (int i = 0; i < 8; ++i) {
    const double at = -1 + (i + 0.5) / 4;
    const VolumeInterval slice = interval_of(model::section(rounded_cube(), i % 3, at), 0.02);
    low += slice.in / 4;
    high += (slice.in + slice.fuzzy) / 4;
  }
  EXPECT_LT(low, 1.02 * (whole.in + whole.fuzzy));  // the midpoint rule is good to a percent
  EXPECT_GT(high, 0.98 * whole.in);
}

/// A section across the new axis gives back what was extruded.
TEST(Sections, OfPrismsAreWhatTheyStandOn) {
  Seeded s;
  const auto torus = model::torus(2, 1);
  const auto again = model::section(model::extrude(torus, {1}), 3, 0.5);
  expect_contains(interval_of(again, 0.15), 4 * pi * pi, 0.5);
  check_labels<3>(again, 0.3, s.random, [&](const Point& x, Real margin) { return where(torus, x, margin); });
  const auto aside =
      model::section(model::extrude(model::cone(2, 1, 0.5), {1}), 0, 0.3);  // a prism over a hyperbola
  check_labels<3>(aside, 0.1, s.random, [&](const Point& x, Real margin) {
    const Where cone = where(model::cone(2, 1, 0.5), {0.3, x[0], x[1]}, margin);
    return Where{cone.inside && x[2] > 0 && x[2] < 1,
                 cone.doubtful || std::fabs(x[2]) < margin || std::fabs(x[2] - 1) < margin};
  });
}

// --- the process ---

template <int D, typename Truth>
void check_first_producer(const Expression& e, unsigned deepest, Random& random, Truth&& truth) {
  const Network<D> network = compile<D>(e, {});
  ASSERT_EQ(network.producers[0].kind, ProducerKind::preimage);
  check_stream_of<D>(network, PreimageProducer<D>(network, network.producers[0]), deepest, truth, random,
                     true);
}

TEST(PreimageProducer, EmitsAStreamOfRefinements) {
  Seeded s;
  const auto torus = model::transform(free_matrix(s.random, 3, 0.2), model::torus(2, 1));
  check_first_producer<2>(model::section(torus, 1, 0.1), 18, s.random, [&](const Point& x) {
    return where(torus, {x[0], 0.1, x[1]}, 1e-10L);
  });
  check_first_producer<4>(model::extrude(model::torus(2, 1), {1}), 12, s.random, [&](const Point& x) {
    return where(model::torus(2, 1), {x[0], x[1], x[2]}, 1e-10L);
  });
  // The producer knows nothing of where the cone ends.
  check_first_producer<2>(model::section(model::cone(2, 1, 0.5), 0, 0.3), 18, s.random, [&](const Point& x) {
    const Real beyond = std::hypot(x[0], Real{0.3}) - (1 - x[1] / 4);
    return Where{beyond < 0, std::fabs(beyond) < 1e-10L};
  });
  check_first_producer<3>(model::extrude(nurbs_disk(1), {1}), 14, s.random, [&](const Point& x) {
    const Real beyond = std::hypot(x[0], x[1]) - 1;
    return Where{beyond < 0, std::fabs(beyond) < 1e-10L};
  });
}

TEST(PreimageProducer, CellsDoNotDependOnThreadsAndOrder) {
  expect_same_digest<2>(model::section(model::torus(2, 1), 2, 0.3), thinner_than(0.01), 1);
  expect_same_digest<3>(model::subtract({model::extrude(nurbs_disk(1), {1}), model::cuboid({1, 1, 1})}),
                        thinner_than(0.05), 1);
  expect_same_digest<4>(model::extrude(model::torus(2, 1), {1}), down_to(16), 1);
}

}  // namespace
}  // namespace bsp2::dataflow
