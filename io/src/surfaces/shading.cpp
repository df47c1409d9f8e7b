#include "surfaces/shading.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bsp2/geometry/support/disjoint_sets.hpp"
#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::io {
namespace {

using Direction = std::array<double, 3>;

Direction difference(const SinglePoint3& a, const SinglePoint3& b) {
  return {double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]};
}

using geometry::dot;

double length_of(const Direction& v) { return std::sqrt(dot(v, v)); }

/// Normals of triangles. That of a sliver, which rounding may have turned anyhow, is that of its neighbour at
/// the longest side, in whose plane it nearly lies.
class FacetNormals {
 public:
  FacetNormals(const SingleSurface& surface, const EdgePairs& pairs) : surface_(surface) {
    for (const SinglePoint3& point : surface.points)
      for (const float x : point) reach_ = std::max(reach_, std::fabs(double{x}));
    const std::size_t count = surface.triangles.size();
    normal_.resize(count);
    std::vector<HalfEdge> longest(count, no_half_edge);  // of slivers
    for (std::uint32_t t = 0; t < count; ++t)
      if (!find(t)) longest[t] = longest_side(t);
    for (std::uint32_t t = 0; t < count; ++t) {
      std::uint32_t at = t;
      for (int steps = 0; steps < 32 && longest[at] != no_half_edge; ++steps) {
        const HalfEdge other = pairs.partner[longest[at]];
        if (other == no_half_edge) break;
        at = other / 3;
      }
      if (at != t && longest[at] == no_half_edge) normal_[t] = normal_[at];
    }
  }
  const Direction& operator[](std::uint32_t t) const { return normal_[t]; }

 private:
  const SingleSurface& surface_;
  double reach_ = 0;
  std::vector<Direction> normal_;

  [[nodiscard]] const SinglePoint3& corner(std::uint32_t t, std::size_t k) const {
    return surface_.points[surface_.triangles[t][k % 3]];
  }
  [[nodiscard]] HalfEdge longest_side(std::uint32_t t) const {
    HalfEdge longest = 3 * t;
    double most = -1;
    for (std::uint32_t k = 0; k < 3; ++k)
      if (const double length = length_of(difference(corner(t, k + 1), corner(t, k))); length > most) {
        most = length;
        longest = 3 * t + k;
      }
    return longest;
  }
  /// @return false for a sliver: rounding, of 2^-24 of a coordinate, may have turned it by half a degree.
  bool find(std::uint32_t t) {
    const Direction u = difference(corner(t, 1), corner(t, 0)), v = difference(corner(t, 2), corner(t, 0)),
                    w = difference(corner(t, 2), corner(t, 1));
    Direction n;
    for (std::size_t k = 0; k < 3; ++k)
      n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    const double area = length_of(n), side = std::max({length_of(u), length_of(v), length_of(w)});
    if (area > 0)
      for (std::size_t k = 0; k < 3; ++k) normal_[t][k] = n[k] / area;
    else
      normal_[t] = {0, 0, 1};
    return area > side * 128 * 6e-8 * reach_;
  }
};

double angle_at(const SingleSurface& surface, std::uint32_t corner) {
  const auto& t = surface.triangles[corner / 3];
  const SinglePoint3& p = surface.points[t[corner % 3]];
  const Direction u = difference(surface.points[t[(corner + 1) % 3]], p),
                  v = difference(surface.points[t[(corner + 2) % 3]], p);
  const double cosine = dot(u, v) / (length_of(u) * length_of(v));
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

}  // namespace

ShadedSurface shaded(const SingleSurface& surface) {
  ShadedSurface result;
  const EdgePairs pairs = pair_edges(surface.points, surface.triangles);
  const FacetNormals normals(surface, pairs);
  const auto corners = static_cast<std::uint32_t>(3 * surface.triangles.size());
  geometry::DisjointSets sets(corners);
  const double smooth = std::cos(sharp_angle * std::numbers::pi / 180);
  for (HalfEdge h = 0; h < corners; ++h) {
    const HalfEdge other = pairs.partner[h];
    if (other != no_half_edge && other < h) continue;
    if (other != no_half_edge && dot(normals[h / 3], normals[other / 3]) >= smooth) {
      sets.unite(h, next_of(other));
      sets.unite(next_of(h), other);
    } else {
      const HalfEdge next = next_of(h);
      result.sharp_edges.push_back({surface.triangles[h / 3][h % 3], surface.triangles[next / 3][next % 3]});
    }
  }
  for (auto& edge : result.sharp_edges) std::sort(edge.begin(), edge.end());
  std::sort(result.sharp_edges.begin(), result.sharp_edges.end());
  result.sharp_edges.erase(std::unique(result.sharp_edges.begin(), result.sharp_edges.end()),
                           result.sharp_edges.end());
  std::vector<Direction> sums;
  std::vector<std::uint32_t> vertex(corners), first;
  result.triangles.resize(surface.triangles.size());
  for (std::uint32_t corner = 0; corner < corners; ++corner) {
    const std::uint32_t ring = sets.find(corner);
    if (ring == corner) {
      vertex[corner] = static_cast<std::uint32_t>(sums.size());
      sums.push_back({});
      first.push_back(corner / 3);
      result.point.push_back(surface.triangles[corner / 3][corner % 3]);
    }
    vertex[corner] = vertex[ring];
    result.triangles[corner / 3][corner % 3] = vertex[ring];
    const double angle = angle_at(surface, corner);
    for (std::size_t k = 0; k < 3; ++k) sums[vertex[ring]][k] += angle * normals[corner / 3][k];
  }
  result.normal.reserve(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    double length = length_of(sums[i]);
    if (!(length > 1e-6)) length = length_of(sums[i] = normals[first[i]]);
    SinglePoint3& unit = result.normal.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) unit[k] = static_cast<float>(sums[i][k] / length);
  }
  return result;
}

}  // namespace bsp2::io
