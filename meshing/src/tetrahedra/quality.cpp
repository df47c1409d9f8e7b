#include <numbers>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

/// See Quality.
double aspect_of(const std::array<const Point*, 4>& p, const std::array<Point, 4>& normals) {
  double longest = 0, twice_area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    twice_area += std::sqrt(dot(normals[i], normals[i]));
    for (std::size_t k = i + 1; k < 4; ++k) longest = std::max(longest, squared_distance(*p[i], *p[k]));
  }
  const double six_volumes = -dot(normals[3], *p[3] - *p[0]);
  const double measure = twice_area * std::sqrt(longest);  // the radius is 3 volumes by the area
  return measure > 0 ? std::clamp(2 * std::sqrt(6.0) * six_volumes / measure, 0.0, 1.0) : 0;
}

}  // namespace

Quality quality_of(const Tetrahedra& mesh) {
  Quality quality;
  double sum = 0, sum_of_aspects = 0;
  for (const auto& t : mesh.tetrahedra) {
    geometry::Interruption::check();
    const std::array<const Point*, 4> p{&mesh.points[t[0]], &mesh.points[t[1]], &mesh.points[t[2]],
                                        &mesh.points[t[3]]};
    if (orientation(*p[0], *p[1], *p[2], *p[3]) <= 0) ++quality.turned;
    const auto n = normals_of(*p[0], *p[1], *p[2], *p[3]);
    const double aspect = aspect_of(p, n);
    quality.smallest_aspect = std::min(quality.smallest_aspect, aspect);
    sum_of_aspects += aspect;
    double smallest = 180;
    for (int i = 0; i < 4; ++i)
      for (int k = i + 1; k < 4; ++k) {
        const Point sine = cross(n[i], n[k]);
        const double angle =
            std::atan2(std::sqrt(dot(sine, sine)), -dot(n[i], n[k])) * 180 / std::numbers::pi;
        smallest = std::min(smallest, angle);
        quality.largest_angle = std::max(quality.largest_angle, angle);
        ++quality.histogram[static_cast<std::size_t>(std::clamp(angle / 10, 0.0, 17.0))];
      }
    quality.smallest_angle = std::min(quality.smallest_angle, smallest);
    sum += smallest;
    const std::array<double, 3> limits{1, 5, 10};
    for (std::size_t i = 0; i < limits.size(); ++i)
      if (smallest < limits[i]) ++quality.tetrahedra_below[i];
  }
  if (const auto count = static_cast<double>(mesh.tetrahedra.size()); count > 0) {
    quality.mean_smallest_angle = sum / count;
    quality.mean_aspect = sum_of_aspects / count;
  }
  return quality;
}

std::vector<double> volumes_of(const Tetrahedra& mesh, std::size_t parts) {
  std::vector<double> volumes(parts + 1, 0);
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const auto& t = mesh.tetrahedra[i];
    const Point &a = mesh.points[t[0]], &d = mesh.points[t[3]];
    const double volume = dot(cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a), d - a) / 6;
    const auto part = static_cast<std::size_t>(mesh.part[i]);
    volumes[mesh.part[i] >= 0 && part < parts ? part : parts] += volume;
  }
  return volumes;
}

}  // namespace bsp2::meshing
