#include "shapes/mesh_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace bsp2::dataflow {
namespace {

/// Testing all points against all planes pays for itself only on small meshes.
constexpr std::size_t most_convex_triangles = 2000;
/// Beyond this, what is known to be convex is a mesh all the same: nearly all half-spaces of a many-faceted
/// solid cross nearly all cells, but few facets do. The list makes far fewer cells, but its time grows
/// faster. Equal at about 5,000.
constexpr std::size_t most_half_spaces = 10000;

}  // namespace

/// The sign of n . (p 2^-53) + d.
int side(const geometry::Covector<3>& plane, const std::array<std::int64_t, 3>& point) {
  long double value = plane.rounded[3] * 0x1p53L, magnitude = std::fabs(value);
  for (int i = 0; i < 3; ++i) {
    const long double term = plane.rounded[i] * static_cast<long double>(point[i]);
    value += term;
    magnitude += std::fabs(term);
  }
  if (std::fabs(value) > magnitude * 0x1p-60L) return value < 0 ? -1 : 1;
  // Unlike a world covector's, these 216 + 54 bits need more than a LocalInteger.
  using Wide = geometry::FixedInteger<320>;
  Wide exact = Wide(plane.exact[3]) << 53;
  for (int i = 0; i < 3; ++i) exact += Wide(plane.exact[i]) * point[i];
  return exact.sign();
}

MeshShape::MeshShape(const model::TriangleMesh& mesh) : source(&mesh) {
  choose_frame(mesh);
  points.reserve(mesh.points.size());
  triangles.reserve(mesh.triangles.size());
  covectors.reserve(mesh.triangles.size());
  int exponent = 0;
  std::frexp(scale, &exponent);
  --exponent;
  lower.fill(std::numeric_limits<double>::infinity());
  upper.fill(-std::numeric_limits<double>::infinity());
  for (const auto& point : mesh.points) {
    auto& p = points.emplace_back();
    for (int i = 0; i < 3; ++i) {
      p[i] = std::llround(std::ldexp(point[i] - origin[i], 53 - exponent));
      const double x = std::ldexp(static_cast<double>(p[i]), -53);
      lower[i] = std::min(lower[i], x);
      upper[i] = std::max(upper[i], x);
    }
  }
  for (const auto& triangle : mesh.triangles) {
    auto plane = geometry::triangle_covector({points[triangle[0]], points[triangle[1]], points[triangle[2]]});
    if (plane.exact[0].is_zero() && plane.exact[1].is_zero() && plane.exact[2].is_zero()) continue;
    for (std::size_t i = 0; i < 3; ++i) plane.points[i] = triangle[i] + 1;
    triangles.push_back(triangle);
    covectors.push_back(std::move(plane));
  }
  convex = (mesh.convex && triangles.size() <= most_half_spaces) || is_convex();
}

/// A mesh far away from the origin, for its size, is seen from its middle. Origin and differences are exact:
/// the origin is a multiple of a power of two not much smaller than the mesh.
void MeshShape::choose_frame(const model::TriangleMesh& mesh) {
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const auto& point : mesh.points)
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], point[i]);
      high[i] = std::max(high[i], point[i]);
    }
  double extent = 0, reach = 0;
  for (int i = 0; i < 3; ++i) {
    extent = std::max(extent, high[i] - low[i]);
    reach = std::max({reach, std::fabs(low[i]), std::fabs(high[i])});
  }
  int exponent = 0;
  if (reach > 16 * extent && extent > 0) {
    std::frexp(extent, &exponent);
    const double unit = std::ldexp(1.0, exponent);
    for (int i = 0; i < 3; ++i) origin[i] = std::nearbyint(((low[i] / 2) + (high[i] / 2)) / unit) * unit;
    reach = 0;
    for (int i = 0; i < 3; ++i)
      reach = std::max({reach, std::fabs(low[i] - origin[i]), std::fabs(high[i] - origin[i])});
  }
  std::frexp(reach, &exponent);
  scale = std::ldexp(1.0, exponent);
}

bool MeshShape::is_convex() const {
  if (triangles.size() > most_convex_triangles || triangles.size() < 4) return false;
  std::vector<std::uint32_t> used;  // points of triangles
  for (const auto& triangle : triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t point : used) {
      const auto& own = triangles[i];
      if (point == own[0] || point == own[1] || point == own[2])
        continue;  // on the plane, which only exact numbers would tell
      if (side(covectors[i], points[point]) > 0) return false;
    }
  return true;
}

namespace {

/// By points, by counting; then the few at each, each once.
void find_incident(Mesh& mesh) {
  std::vector<std::uint32_t> end(mesh.points.size() + 1);
  for (const Mesh::Facet& facet : mesh.facets)
    for (const std::uint32_t corner : facet.corners) ++end[corner + std::size_t{1}];
  std::partial_sum(end.begin(), end.end(), end.begin());
  auto& incident = mesh.incident;
  incident.resize(end.back());
  for (const Mesh::Facet& facet : mesh.facets)
    for (const std::uint32_t corner : facet.corners) incident[end[corner]++] = facet.plane.id();
  auto kept = incident.begin();
  mesh.incident_offset.assign(1, 0);
  mesh.incident_offset.reserve(mesh.points.size() + 1);
  for (std::size_t point = 0, first = 0; point < mesh.points.size(); first = end[point++]) {
    const auto from = incident.begin() + static_cast<std::ptrdiff_t>(first),
               to = incident.begin() + static_cast<std::ptrdiff_t>(end[point]);
    std::sort(from, to);
    kept = std::copy(from, std::unique(from, to), kept);
    mesh.incident_offset.push_back(static_cast<std::uint32_t>(kept - incident.begin()));
  }
  incident.erase(kept, incident.end());
}

}  // namespace

Mesh place_mesh(const MeshShape& shape, const geometry::Matrix<3>& matrix, int grid_exponent,
                std::span<const geometry::OrientedHyperplane> planes) {
  Mesh mesh{.frame_points = shape.points,
            .map = geometry::AffineMap<3>(matrix, grid_exponent),
            .grid_exponent = grid_exponent,
            .source = shape.source};
  double largest = 0;
  mesh.points.reserve(shape.points.size());
  for (const auto& point : shape.points) {
    auto& placed = mesh.points.emplace_back();
    for (int i = 0; i < 3; ++i) {
      geometry::Float128 sum = matrix[i][3];
      double magnitude = std::fabs(static_cast<double>(sum));
      for (int j = 0; j < 3; ++j) {
        if (matrix[i][j] == 0) continue;  // as most are
        const geometry::Float128 term =
            matrix[i][j] * static_cast<geometry::Float128>(std::ldexp(static_cast<double>(point[j]), -53));
        sum += term;
        magnitude += std::fabs(static_cast<double>(term));
      }
      placed[i] = static_cast<double>(sum);
      largest = std::max(largest, magnitude);
    }
  }
  // What four entries of the map are rounded by on the grid counts for meshes that are tiny in the model.
  mesh.error = largest * 0x1p-51 + std::ldexp(4.0, grid_exponent);
  mesh.facets.reserve(shape.triangles.size());
  for (std::size_t i = 0; i < shape.triangles.size(); ++i)
    mesh.facets.push_back({shape.triangles[i], planes[i]});
  find_incident(mesh);
  return mesh;
}

namespace {

/// Whether a hyperplane passes through a point of the mesh, exactly.
bool is_on(const geometry::HyperplaneTable<3>& table, const Mesh& mesh, geometry::HyperplaneId id,
           std::uint32_t point) {
  const auto* source = table.source(id);
  const auto& place = mesh.frame_points[point];
  if (source->map == mesh.first.map) return side(table.covector(source->covector), place) == 0;
  using Wide = geometry::ExactInteger<3>;
  const auto covector = table.exact(id);
  const auto image = mesh.map.image(place);
  Wide sum = covector[3] << 53;
  for (std::size_t i = 0; i < 3; ++i) sum += covector[i] * Wide(image[i]);
  return sum.is_zero();
}

}  // namespace

bool has_exact_planes(const geometry::HyperplaneTable<3>& table, const Mesh& mesh) {
  for (std::uint32_t facet = 0; facet < mesh.facets.size(); ++facet) {
    const auto& [corners, plane] = mesh.facets[facet];
    const auto* source = table.source(plane.id());
    if (source->map == mesh.first.map && source->covector == mesh.first.covector + facet) continue;
    for (const std::uint32_t corner : corners)
      if (!is_on(table, mesh, plane.id(), corner)) return false;
  }
  return true;
}

const FacetTree& facet_tree(const Mesh& mesh) {
  return mesh.tree->get([&] {
    std::vector<FacetTree::Box> boxes;
    boxes.reserve(mesh.facets.size());
    for (const Mesh::Facet& facet : mesh.facets) {
      FacetTree::Box box{mesh.points[facet.corners[0]], mesh.points[facet.corners[0]]};
      for (const std::uint32_t corner : facet.corners)
        for (std::size_t i = 0; i < 3; ++i) {
          box.low[i] = std::min(box.low[i], mesh.points[corner][i]);
          box.high[i] = std::max(box.high[i], mesh.points[corner][i]);
        }
      boxes.push_back(box);
    }
    return boxes;
  });
}

}  // namespace bsp2::dataflow
