// Projective images of splines: areas and volumes by formula, and FUZZY cells that hold the images of sampled
// points.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "dataflow/refined/spline_samples.hpp"

namespace bsp2::dataflow {
namespace {

using SplineImages = Seeded;
using Matrix = std::vector<double>;

/// x / (c . x + 1).
template <int D>
Matrix perspective(const std::array<double, D>& c) {
  Matrix m = identity_matrix(D);
  std::copy(c.begin(), c.end(), m.end() - D - 1);
  return m;
}

/// The image by the definition of the map.
template <int D>
std::array<double, D> image_of(const Matrix& m, const std::array<double, D>& x) {
  std::array<double, D + 1> y;
  for (std::size_t i = 0; i <= D; ++i) {
    y[i] = m[i * (D + 1) + D];
    for (std::size_t j = 0; j < D; ++j) y[i] += m[i * (D + 1) + j] * x[j];
  }
  std::array<double, D> image;
  for (std::size_t i = 0; i < D; ++i) image[i] = y[i] / y[D];
  return image;
}

template <int D>
std::vector<std::array<double, D>> images_of(const Matrix& m, std::vector<std::array<double, D>> points) {
  for (auto& point : points) point = image_of<D>(m, point);
  return points;
}

/// A random matrix that takes [-2.2, 2.2]^D to finite points: its last row is above 0.2 there.
template <int D>
Matrix random_projective(Random& random) {
  Matrix m = free_matrix(random, D, 2);
  for (std::size_t j = 0; j < D; ++j) m[D * (D + 1) + j] = uniform(random, -1, 1) * 0.8 / (2.2 * D);
  return m;
}

/// The unit ball under x / (a x_1 + 1), whose Jacobian is (a x_1 + 1)^-(D+1).
double ball_image(int d, double a) {
  return std::pow(pi, d / 2.0) / std::tgamma(d / 2.0 + 1) * std::pow(1 - a * a, -(d + 1) / 2.0);
}

TEST_F(SplineImages, OfACircleIsAnEllipse) {
  const Piece circle = nurbs_circle(1);
  for (const double a : {-0.9, 0.3, 0.7}) {
    SCOPED_TRACE(a);
    const Matrix m = perspective<2>({a, 0});
    const VolumeInterval now =
        check_points<2>(model::projective(m, model::spline(2, {circle})),
                        images_of<2>(m, points_of<2>(circle, 100'000, random)), thinner_than(0.001));
    expect_contains(now, ball_image(2, a));
    EXPECT_LT(now.fuzzy, 0.05 * ball_image(2, a));
  }
}

TEST_F(SplineImages, OfASphereIsAnEllipsoid) {
  const Piece sphere = nurbs_sphere(1);
  const Matrix m = perspective<3>({0.24, -0.32, 0});
  const VolumeInterval now =
      check_points<3>(model::projective(m, model::spline(3, {sphere})),
                      images_of<3>(m, points_of<3>(sphere, 100'000, random)), thinner_than(0.1));
  expect_contains(now, ball_image(3, 0.4));
  EXPECT_GT(now.in, 0.5 * ball_image(3, 0.4));
}

/// The plane at infinity passes between the curve and a corner of its control polygon.
TEST_F(SplineImages, NeedPositiveWeightsOfTheSplineAndNotOfItsControlPoints) {
  const Piece circle = nurbs_circle(1);
  const Matrix m = perspective<2>({0.6, 0.6});
  const double area = ball_image(2, 0.6 * std::sqrt(2.0));
  const VolumeInterval now =
      check_points<2>(model::projective(m, model::spline(2, {circle})),
                      images_of<2>(m, points_of<2>(circle, 100'000, random)), thinner_than(0.01));
  expect_contains(now, area);
  EXPECT_LT(now.fuzzy, 0.05 * area);
  const Piece solid = waved_piece<2>(random, {2, 2}, {4, 4}, true);  // in about [0, 3]^2
  const Matrix near = perspective<2>({-0.22, -0.05});
  check_points<2>(model::projective(near, model::spline(2, {solid})),
                  images_of<2>(near, points_of<2>(solid, 100'000, random)), thinner_than(0.05));
  for (const double b : {0.75, -0.71, 3.0}) {
    try {
      static_cast<void>(
          compile<2>(model::projective(perspective<2>({b, b}), model::spline(2, {circle})), {}));
      ADD_FAILURE() << b;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("the plane at infinity meets the solid"), std::string::npos)
          << error.what();
    }
  }
}

TEST_F(SplineImages, HoldTheImagesOfPointsOfCurves) {
  const Piece plane = random_piece<2>(random, {3}, {9}, false),
              space = random_piece<3>(random, {4}, {8}, true);
  const Matrix of_plane = random_projective<2>(random), of_space = random_projective<3>(random);
  check_points<2>(model::projective(of_plane, model::spline(2, {plane})),
                  images_of<2>(of_plane, points_of<2>(plane, 100'000, random)), down_to(14));
  check_points<3>(model::projective(of_space, model::spline(3, {space})),
                  images_of<3>(of_space, points_of<3>(space, 100'000, random)), down_to(14));
}

TEST_F(SplineImages, HoldTheImagesOfPointsOfSurfacesAndSolids) {
  Piece surface = random_piece<3>(random, {3, 2}, {5, 4}, false),
        solid = waved_piece<3>(random, {2, 1, 2}, {3, 2, 3}, true);
  for (std::size_t p = 0; p < solid.points.size(); ++p)
    if (p % 4 != 3) solid.points[p] -= 1;
  const Matrix of_surface = random_projective<3>(random), of_solid = random_projective<3>(random);
  check_points<3>(model::projective(of_surface, model::spline(3, {surface})),
                  images_of<3>(of_surface, points_of<3>(surface, 100'000, random)), down_to(13));
  check_points<3>(model::projective(of_solid, model::spline(3, {solid})),
                  images_of<3>(of_solid, points_of<3>(solid, 100'000, random)), down_to(13));
}

TEST_F(SplineImages, HoldTheImagesOfPointsInFourDimensions) {
  const Piece curve = random_piece<4>(random, {3}, {4}, true);
  Piece surface = random_piece<4>(random, {2, 1}, {3, 3}, false);
  const Matrix of_curve = random_projective<4>(random), of_surface = random_projective<4>(random);
  check_points<4>(model::projective(of_curve, model::spline(4, {curve})),
                  images_of<4>(of_curve, points_of<4>(curve, 100'000, random)), down_to(13));
  check_points<4>(model::projective(of_surface, model::spline(4, {surface})),
                  images_of<4>(of_surface, points_of<4>(surface, 100'000, random)), down_to(11));
}

/// Under maps and Booleans, within a Boolean under the map, and as text.
TEST_F(SplineImages, GoWithMapsAndBooleans) {
  const Piece circle = nurbs_circle(1);
  const Matrix m = perspective<2>({0.3, 0}), placed{2, 1, 3, 0, 2, -1, 0, 0, 1};
  const Expression spline = model::spline(2, {circle});
  auto points = points_of<2>(circle, 100'000, random);
  for (auto& [x, y] : points) x = 2 * x + y + 3, y = 2 * y - 1;
  check_points<2>(model::projective(m, model::transform(placed, spline)), images_of<2>(m, points),
                  thinner_than(0.01));
  const Expression ring = model::projective(m, model::subtract({model::cuboid({4, 4}, true), spline}));
  const double exact = 4 * (std::pow(0.4, -2) - std::pow(1.6, -2)) /
                       (2 * 0.3);  // of the square: 4 times the integral of (0.3 x + 1)^-3 over [-2, 2]
  const VolumeInterval now = volume_interval<2>(ring, thinner_than(0.001));
  expect_contains(now, exact - ball_image(2, 0.3));
  EXPECT_LT(now.fuzzy, 0.05 * exact);
  const Expression text =
      model::parse_csg(
          "projective([[1,0,0],[0,1,0],[0.3,0,1]]) nurbs(degree = 2, points = "
          "[[1,0],[1,1],[0,1],[-1,1],[-1,0],[-1,-1],[0,-1],[1,-1],[1,0]], "
          "knots = [0,0,0,1,1,2,2,3,3,4,4,4], weights = "
          "[1,0.70710678118654757,1,0.70710678118654757,1,0.70710678118654757,1,0.70710678118654757,1]);",
          "test.csg", {})
          .expression;
  expect_contains(volume_interval<2>(text, thinner_than(0.01)), ball_image(2, 0.3));
}

TEST_F(SplineImages, DoNotDependOnThreadsAndOrder) {
  expect_same_digest<2>(model::projective(perspective<2>({0.6, 0.6}), model::spline(2, {nurbs_circle(1)})),
                        thinner_than(0.01), 2);
}

}  // namespace
}  // namespace bsp2::dataflow
