#include <algorithm>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "simplices/shape.hpp"
#include "tetrahedra/wedges.hpp"

namespace bsp2::meshing {
namespace {

constexpr std::array<double, 3> limits{1, 5, 10};  // of Quality::tetrahedra_below

/// A tetrahedron with an angle below a limit, and its angles that are.
struct Thin {
  std::uint32_t tetrahedron;
  double smallest;
  std::vector<std::pair<Wedges::Edge, double>> angles;
};

/// How many of them are thin because the solid is as sharp there, by limit.
std::array<std::uint64_t, 3> count_of_solid(const Tetrahedra& mesh, const std::vector<Thin>& thin) {
  std::vector<Wedges::Edge> edges;
  for (const Thin& some : thin)
    for (const auto& [edge, angle] : some.angles) edges.push_back(edge);
  const Wedges wedges(mesh, edges);
  std::array<std::uint64_t, 3> counts{};
  for (const Thin& some : thin)
    for (std::size_t i = 0; i < limits.size(); ++i) {
      const auto is_of_solid = [&](const std::pair<Wedges::Edge, double>& at) {
        return at.second >= limits[i] || wedges.angle(at.first, some.tetrahedron) < limits[i];
      };
      if (some.smallest < limits[i] && std::ranges::all_of(some.angles, is_of_solid)) ++counts[i];
    }
  return counts;
}

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
  std::vector<Thin> thin;
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const auto& t = mesh.tetrahedra[i];
    geometry::Interruption::check();
    const std::array<const Point*, 4> p{&mesh.points[t[0]], &mesh.points[t[1]], &mesh.points[t[2]],
                                        &mesh.points[t[3]]};
    if (orientation(*p[0], *p[1], *p[2], *p[3]) <= 0) ++quality.turned;
    const auto n = normals_of(*p[0], *p[1], *p[2], *p[3]);
    const double aspect = aspect_of(p, n);
    quality.smallest_aspect = std::min(quality.smallest_aspect, aspect);
    sum_of_aspects += aspect;
    Thin found{static_cast<std::uint32_t>(i), 180, {}};
    for (const DihedralAngle& angle : dihedral_angles(n)) {
      found.smallest = std::min(found.smallest, angle.degrees);
      quality.largest_angle = std::max(quality.largest_angle, angle.degrees);
      ++quality.histogram[static_cast<std::size_t>(std::clamp(angle.degrees / 10, 0.0, 17.0))];
      if (angle.degrees < limits.back())
        found.angles.emplace_back(Wedges::edge_between(t[angle.edge[0]], t[angle.edge[1]]), angle.degrees);
    }
    quality.smallest_angle = std::min(quality.smallest_angle, found.smallest);
    sum += found.smallest;
    for (std::size_t k = 0; k < limits.size(); ++k)
      if (found.smallest < limits[k]) ++quality.tetrahedra_below[k];
    if (found.smallest < limits.back()) thin.push_back(std::move(found));
  }
  quality.of_solid = count_of_solid(mesh, thin);
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
    const double volume =
        volume_of(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], mesh.points[t[3]]);
    const auto part = static_cast<std::size_t>(mesh.part[i]);
    volumes[mesh.part[i] >= 0 && part < parts ? part : parts] += volume;
  }
  return volumes;
}

}  // namespace bsp2::meshing
