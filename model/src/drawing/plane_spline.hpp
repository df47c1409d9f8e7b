#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "bsp2/model/expression/tessellation.hpp"

namespace bsp2::model {

/// A B-spline in the plane, rational where its weights differ.
struct PlaneSpline {
  using Point = std::array<double, 2>;
  static constexpr int max_degree = 25;

  int degree = 3;
  std::vector<Point> points;    ///< n of them, more than the degree
  std::vector<double> knots;    ///< n + degree + 1, never less than the one before
  std::vector<double> weights;  ///< n, positive

  /// What is wrong with it, to end a sentence with; empty if nothing is.
  [[nodiscard]] std::string fault() const;
};

/// The cubic spline through these points, twice differentiable, whose parameter grows by their distances.
/// What is not given at an end is natural: the curvature is 0 there.
/// @param tangents at the first and at the last point; only the direction counts, {0, 0} is none.
/// @param closed whether it goes on from the last point to the first one.
/// @return nothing if fewer than two points differ.
PlaneSpline spline_through(std::vector<PlaneSpline::Point> points,
                           const std::array<PlaneSpline::Point, 2>& tangents, bool closed);

/// Points on a spline from its beginning to its end, both included, as many as an arc has that turns as far
/// and is as long: the sides of a circle of the radius that the spline has at a place, for the share of a
/// full turn that it goes there. Corners, where knots coincide as often as the degree says, are among them.
///
/// Time: linear in the number of its points and of those that come out, times the square of the degree.
/// @param spend is called with the number of steps before they are taken, and may throw.
/// @pre fault() is empty.
/// @throws bsp2::Error for more than max_sides.
std::vector<PlaneSpline::Point> sampled(const PlaneSpline& spline, const Resolution& resolution,
                                        const std::function<void(std::size_t)>& spend);

}  // namespace bsp2::model
