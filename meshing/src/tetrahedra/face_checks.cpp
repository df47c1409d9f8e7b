#include "tetrahedra/face_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::meshing {
namespace {

using geometry::cross;
using geometry::dot;
using geometry::minus;

/// What is skew for checkMesh.
constexpr double most_skewness = 4;

Point& add(Point& sum, double factor, const Point& p) {
  for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += factor * p[axis];
  return sum;
}

double length(const Point& v) { return std::sqrt(dot(v, v)); }

/// Of a face, in triangles about the mean of its corners.
struct FaceMeasure {
  Point middle{}, area{};  ///< the area as a vector, out of the owner
};

FaceMeasure measure(const Complex& complex, std::size_t face) {
  const auto corners = complex.points_of(face);
  Point mean{};
  for (const std::uint32_t corner : corners)
    add(mean, 1.0 / static_cast<double>(corners.size()), complex.points[corner]);
  FaceMeasure result;
  double whole = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Point &a = complex.points[corners[k]], &b = complex.points[corners[(k + 1) % corners.size()]];
    const Point twice = cross(minus(b, a), minus(mean, a));
    const double size = length(twice);
    add(result.area, 0.5, twice);
    for (const Point* p : {&a, &b, &std::as_const(mean)}) add(result.middle, size / 3, *p);
    whole += size;
  }
  for (double& x : result.middle) x /= whole;
  return whole > 0 ? result : FaceMeasure{mean, {}};
}

/// Middles of cells: of pyramids over the faces, with the mean of their middles as the top.
std::vector<Point> middles_of_cells(const Complex& complex, const std::vector<FaceMeasure>& faces) {
  std::vector<Point> mean(complex.cells()), middle(complex.cells());
  std::vector<double> count(complex.cells()), volume(complex.cells());
  const auto for_sides = [&](const auto& use) {
    for (std::size_t face = 0; face < complex.faces(); ++face) {
      use(face, static_cast<std::size_t>(complex.owner[face]), 1.0);
      if (complex.neighbour[face] != Complex::outside)
        use(face, static_cast<std::size_t>(complex.neighbour[face]), -1.0);
    }
  };
  for_sides([&](std::size_t face, std::size_t cell, double) {
    add(mean[cell], 1, faces[face].middle);
    ++count[cell];
  });
  for (std::size_t cell = 0; cell < complex.cells(); ++cell)
    for (double& x : mean[cell]) x /= count[cell];
  for_sides([&](std::size_t face, std::size_t cell, double sign) {
    const double pyramid = sign * dot(faces[face].area, minus(faces[face].middle, mean[cell]));
    add(add(middle[cell], 0.75 * pyramid, faces[face].middle), 0.25 * pyramid, mean[cell]);
    volume[cell] += pyramid;
  });
  for (std::size_t cell = 0; cell < complex.cells(); ++cell)
    for (double& x : middle[cell]) x /= volume[cell];
  return middle;
}

/// How far the line from `from` along `way` misses the middle of a face, against the rim of the face there,
/// which is taken to be no nearer than `least`.
double skewness(const Complex& complex, std::size_t face, const FaceMeasure& measure, const Point& from,
                const Point& way, double least) {
  const Point to_face = minus(measure.middle, from);
  Point missed = to_face;
  add(missed, -dot(measure.area, to_face) / dot(measure.area, way), way);
  const double distance = length(missed);
  double rim = least;
  for (const std::uint32_t corner : complex.points_of(face))
    rim = std::max(rim, std::abs(dot(missed, minus(complex.points[corner], measure.middle))) / distance);
  return distance > 0 ? distance / rim : 0;
}

bool is_wrong(const Complex& complex, std::size_t face, const FaceMeasure& measure,
              const std::vector<Point>& middles) {
  const Point& from = middles[static_cast<std::size_t>(complex.owner[face])];
  const double behind = dot(measure.area, minus(measure.middle, from));
  if (!(behind > 0)) return true;
  if (complex.neighbour[face] == Complex::outside) {
    Point way{};  // straight to the face
    add(way, behind / dot(measure.area, measure.area), measure.area);
    return skewness(complex, face, measure, from, way, 0.4 * length(way)) > most_skewness;
  }
  const Point& to = middles[static_cast<std::size_t>(complex.neighbour[face])];
  if (!(dot(measure.area, minus(to, measure.middle)) > 0)) return true;
  const Point way = minus(to, from);
  return skewness(complex, face, measure, from, way, 0.2 * length(way)) > most_skewness;
}

}  // namespace

std::vector<std::uint32_t> wrong_faces(const Complex& complex) {
  std::vector<FaceMeasure> measures;
  for (std::size_t face = 0; face < complex.faces(); ++face) measures.push_back(measure(complex, face));
  const std::vector<Point> middles = middles_of_cells(complex, measures);
  std::vector<std::uint32_t> wrong;
  for (std::uint32_t face = 0; face < complex.faces(); ++face)
    if (is_wrong(complex, face, measures[face], middles)) wrong.push_back(face);
  return wrong;
}

}  // namespace bsp2::meshing
