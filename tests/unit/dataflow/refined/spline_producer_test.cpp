// The producer of splines alone: streams that refine, of random curves, surfaces and solids.

#include "producers/spline_producer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "dataflow/producer_stream.hpp"
#include "dataflow/refined/spline_samples.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using SplineProducers = Seeded;
using Truth = std::function<Where(const Point&)>;

const Truth nowhere = [](const Point&) { return Where{false, false}; };

template <int D>
void check_stream(const Expression& e, unsigned deepest, const Truth& truth, Random& random,
                  std::vector<std::array<double, D>> on_surface = {}) {
  const Network<D> network = compile<D>(e, {});
  ASSERT_EQ(network.splines.size(), 1U);
  check_stream_of<D>(network, SplineProducer<D>(network, network.producers[0]), deepest, truth, random, false,
                     std::move(on_surface));
}

TEST_F(SplineProducers, EmitAStreamOfRefinementsOfRoundSolids) {
  const auto of_ball = [](const Point& x) {
    Real square = 0;
    for (const Real c : x) square += c * c;
    return Where{square < 1, std::fabs(square - 1) < 1e-12L};
  };
  check_stream<2>(model::spline(2, {nurbs_circle(1)}), 14, of_ball, random,
                  points_of<2>(nurbs_circle(1), 2000, random));
  check_stream<3>(model::spline(3, {nurbs_sphere(1)}), 12, of_ball, random,
                  points_of<3>(nurbs_sphere(1), 2000, random));
}

/// Of fewer parameters than a boundary has, of as many but open, and in more dimensions than have an inside:
/// nothing is IN.
template <int D>
void check_thin_streams(Random& random, std::size_t parameters, int rounds, unsigned deepest) {
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::uint32_t> degrees;
    std::vector<std::size_t> counts;
    for (std::size_t j = 0; j < parameters; ++j) {
      degrees.push_back(static_cast<std::uint32_t>(pick(random, 1, parameters < 3 ? 4 : 2)));
      counts.push_back(degrees[j] + static_cast<std::size_t>(pick(random, 1, parameters < 3 ? 4 : 2)));
    }
    const bool rational = chance(random, 0.5);
    const Piece piece = chance(random, 0.5) ? random_piece<D>(random, degrees, counts, rational)
                                            : waved_piece<D>(random, degrees, counts, rational);
    SCOPED_TRACE(testing::Message() << "D=" << D << ", " << parameters << " parameters, round " << round);
    check_stream<D>(model::spline(D, {piece}), deepest, nowhere, random, points_of<D>(piece, 2000, random));
  }
}

TEST_F(SplineProducers, EmitStreamsOfRefinementsOfCurves) {
  check_thin_streams<2>(random, 1, 20, 14);
  check_thin_streams<3>(random, 1, 15, 14);
  check_thin_streams<4>(random, 1, 8, 13);
}

TEST_F(SplineProducers, EmitStreamsOfRefinementsOfSurfaces) {
  check_thin_streams<3>(random, 2, 15, 12);
  check_thin_streams<4>(random, 2, 8, 11);
}

TEST_F(SplineProducers, EmitStreamsOfRefinementsOfThickSplinesInFourDimensions) {
  check_thin_streams<4>(random, 3, 4, 10);
  check_thin_streams<4>(random, 4, 3, 9);
}

// --- solids: the winding number of a polygon or polyhedron between points of the faces is an oracle at some
// distance from them ---------------------------

/// The faces of the domain at (n + 1)^(D-1) parameters each, index by index; the last parameter runs fastest.
template <int D>
std::vector<std::array<double, D>> face_of(const Piece& piece, std::size_t axis, bool at_end, int n) {
  std::vector<std::array<double, D>> points;
  const auto end = [&](std::size_t j, double share) {
    const double low = piece.knots[j][piece.degrees[j]],
                 high = piece.knots[j][piece.knots[j].size() - piece.degrees[j] - 1];
    return share >= 1 ? high : low + share * (high - low);
  };
  const int count = D == 2 ? n + 1 : (n + 1) * (n + 1);
  for (int i = 0; i < count; ++i) {
    std::vector<double> t(D);
    t[axis] = end(axis, at_end ? 1 : 0);
    const std::size_t u = (axis + 1) % D, v = (axis + 2) % D;
    t[u] = end(u, static_cast<double>(D == 2 ? i : i / (n + 1)) / n);
    if constexpr (D == 3) t[v] = end(v, static_cast<double>(i % (n + 1)) / n);
    points.push_back(value_at<D>(piece, t));
  }
  return points;
}

/// The signed angle of an edge, or solid angle of a triangle (van Oosterom and Strackee 1983), seen from x.
double angle(const std::array<double, 2>& x, const std::array<double, 2>& a, const std::array<double, 2>& b) {
  const double ax = a[0] - x[0], ay = a[1] - x[1], bx = b[0] - x[0], by = b[1] - x[1];
  return std::atan2(ax * by - ay * bx, ax * bx + ay * by);
}
double angle(const std::array<double, 3>& x, std::array<double, 3> a, std::array<double, 3> b,
             std::array<double, 3> c) {
  for (std::size_t i = 0; i < 3; ++i) a[i] -= x[i], b[i] -= x[i], c[i] -= x[i];
  const auto dot = [](const auto& p, const auto& q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; };
  const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
  const double volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                        a[2] * (b[0] * c[1] - b[1] * c[0]);
  return 2 * std::atan2(volume, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

/// Where points are about a solid spline. In doubt where they are nearer to a face's points than these are to
/// each other.
template <int D>
Truth winding_around(const Piece& piece, int n) {
  struct Face {
    std::vector<std::array<double, D>> points;
    double sign;
  };
  std::vector<Face> faces;
  double step = 0;
  for (std::size_t axis = 0; axis < D; ++axis)
    for (const bool at_end : {false, true}) {
      // Faces across axis k, with the others in cyclic order, are oriented by the end; in the plane by the
      // axis too.
      faces.push_back(
          {face_of<D>(piece, axis, at_end, n), (at_end ? 1.0 : -1.0) * (D == 2 && axis == 1 ? -1 : 1)});
      const auto& points = faces.back().points;
      const std::size_t width = static_cast<std::size_t>(n) + 1;
      for (const std::size_t next : {std::size_t{1}, width})
        for (std::size_t i = 0; i + next < points.size(); ++i) {
          if (next == 1 && i % width + 1 == width) continue;  // the end of a row
          double square = 0;
          for (std::size_t k = 0; k < D; ++k) square += std::pow(points[i + next][k] - points[i][k], 2);
          step = std::max(step, std::sqrt(square));
        }
    }
  return [faces, step, n](const Point& at) {
    std::array<double, D> x;
    std::copy(at.begin(), at.end(), x.begin());
    double nearest = std::numeric_limits<double>::infinity(), sum = 0;
    for (const auto& [points, sign] : faces) {
      for (const auto& p : points) {
        double square = 0;
        for (std::size_t k = 0; k < D; ++k) square += std::pow(p[k] - x[k], 2);
        nearest = std::min(nearest, square);
      }
      const auto width = static_cast<std::size_t>(n) + 1;
      if constexpr (D == 2) {
        for (std::size_t i = 0; i + 1 < width; ++i) sum += sign * angle(x, points[i], points[i + 1]);
      } else {
        for (std::size_t i = 0; i + 1 < width; ++i)
          for (std::size_t j = 0; j + 1 < width; ++j) {
            const auto &a = points[i * width + j], &b = points[(i + 1) * width + j],
                       &c = points[(i + 1) * width + j + 1], &d = points[i * width + j + 1];
            sum += sign * (angle(x, a, b, c) + angle(x, a, c, d));
          }
      }
    }
    return Where{std::lround(sum / (D == 2 ? 2 * pi : 4 * pi)) != 0, std::sqrt(nearest) < 1.5 * step};
  };
}

template <int D>
void check_solid_streams(Random& random, int rounds, unsigned deepest, int n) {
  int surely_inside = 0;  // of thin pieces nothing is
  for (int round = 0; round < rounds || (surely_inside == 0 && round < samples::all_rounds(40)); ++round) {
    SCOPED_TRACE(testing::Message() << "D=" << D << ", round " << round);
    std::vector<std::uint32_t> degrees;
    std::vector<std::size_t> counts;
    for (int j = 0; j < D; ++j) {
      degrees.push_back(static_cast<std::uint32_t>(pick(random, 1, 3)));
      counts.push_back(degrees.back() + static_cast<std::size_t>(pick(random, 1, 2)));
    }
    const Piece piece = waved_piece<D>(random, degrees, counts, chance(random, 0.5));
    const Truth oracle = winding_around<D>(piece, n);
    const Truth truth = [&](const Point& x) {
      const Where there = oracle(x);
      surely_inside += there.inside && !there.doubtful ? 1 : 0;
      return there;
    };
    Point middle;
    for (const std::size_t count : counts) middle.push_back(static_cast<Real>(count - 1) / 2);
    if (*std::min_element(counts.begin(), counts.end()) > 2) {
      EXPECT_TRUE(truth(middle).inside);
    }
    check_stream<D>(model::spline(D, {piece}), deepest, truth, random, points_of<D>(piece, 2000, random));
  }
  EXPECT_GT(surely_inside, 0);
}

TEST_F(SplineProducers, EmitStreamsOfRefinementsOfSolidsInThePlane) {
  check_solid_streams<2>(random, samples::rounds(15), 16, 60);
}

TEST_F(SplineProducers, EmitStreamsOfRefinementsOfSolidsInSpace) {
  check_solid_streams<3>(random, samples::rounds(4), 22, 20);
}

}  // namespace
}  // namespace bsp2::dataflow
