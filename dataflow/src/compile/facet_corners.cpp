#include "compile/facet_corners.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::cross;
using geometry::dot;
using Vector = std::array<double, 3>;

/// By how many tolerances a corner may move: hyperplanes that meet at less than some degrees make more of it.
constexpr double most_tolerances = 4;
/// What misses a corner by less than this share of the tolerance misses it by rounding.
constexpr double rounding = 0x1p-17;
/// At a corner of more hyperplanes all threes of them are too many to be looked at: it counts as moved.
constexpr std::size_t most_at_a_corner = 12;
/// Of so many facets one may be in another one's plane by chance. Where flat faces are rounded far more are.
constexpr std::size_t facets_a_chance = 64;

}  // namespace

FacetCorners::FacetCorners(const geometry::HyperplaneTable<3>& table, const MergedFacets& facets,
                           double tolerance)
    : table_(table), facets_(facets), tolerance_(tolerance) {
  const auto& triangles = facets.shape.triangles;
  bool all_own = true;
  for (std::size_t i = 0; i < triangles.size() && all_own; ++i) all_own = is_own(i);
  if (all_own) return;
  offset_.assign(facets.shape.points.size() + 1, 0);
  for (const auto& triangle : triangles)
    for (const std::uint32_t corner : triangle) ++offset_[corner + 1];
  std::partial_sum(offset_.begin(), offset_.end(), offset_.begin());
  around_.resize(offset_.back());
  std::vector<std::uint32_t> next(offset_.begin(), offset_.end() - 1);
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t corner : triangles[i]) around_[next[corner]++] = i;
}

bool FacetCorners::is_own(std::size_t facet) const {
  const auto* const source = table_.source(facets_.planes[facet].id());
  return source->map == facets_.map && source->covector == facets_.first_covector + facet;
}

/// Whether another facet of the mesh represents one, and misses corners of it.
bool FacetCorners::is_tilted(std::size_t facet) const {
  const auto* const source = table_.source(facets_.planes[facet].id());
  if (source->map != facets_.map || source->covector == facets_.first_covector + facet) return false;
  const auto& plane = table_.covector(source->covector);
  return std::ranges::any_of(facets_.shape.triangles[facet], [&](std::uint32_t corner) {
    return side(plane, facets_.shape.points[corner]) != 0;
  });
}

std::span<const std::uint32_t> FacetCorners::facets_at(std::uint32_t corner) const {
  return std::span(around_).subspan(offset_[corner], offset_[corner + 1] - offset_[corner]);
}

Vector FacetCorners::place(std::uint32_t corner) const {
  const auto& point = facets_.shape.points[corner];
  Vector placed;
  for (std::size_t i = 0; i < 3; ++i) {
    auto sum = static_cast<long double>(facets_.matrix[i][3]);
    for (std::size_t j = 0; j < 3; ++j)
      sum += static_cast<long double>(facets_.matrix[i][j]) *
             std::ldexp(static_cast<long double>(point[j]), -53);
    placed[i] = static_cast<double>(sum);
  }
  return placed;
}

void FacetCorners::find_misses(std::uint32_t corner, std::vector<Miss>& misses) const {
  misses.clear();
  const Vector point = place(corner);
  for (const std::uint32_t facet : facets_at(corner)) {
    const geometry::HyperplaneId id = facets_.planes[facet].id();
    const auto known = std::find_if(misses.begin(), misses.end(), [&](const Miss& m) { return m.id == id; });
    if (known != misses.end()) {
      if (is_own(facet)) known->distance = 0;
      continue;
    }
    const auto h = table_.rounded(id);
    const double distance = is_own(facet) ? 0 : h.at(point);
    const bool is_rounding = std::fabs(distance) <= std::max(rounding * tolerance_, 2 * h.error);
    misses.push_back({id, h.normal, is_rounding ? 0 : distance});
  }
}

/// Whether the line in which two hyperplanes meet is far from the corner. The nearest point of it is a sum of
/// their normals.
bool FacetCorners::two_part(const Miss& a, const Miss& b) const {
  if (a.distance == 0 && b.distance == 0) return false;
  const Vector line = cross(a.normal, b.normal);
  const double square = (a.distance * a.distance) + (b.distance * b.distance) -
                        (2 * dot(a.normal, b.normal) * a.distance * b.distance);
  const double most = most_tolerances * tolerance_;
  return square > most * most * dot(line, line);
}

/// Whether the point in which three meet is.
bool FacetCorners::three_part(const Miss& a, const Miss& b, const Miss& c) const {
  if (a.distance == 0 && b.distance == 0 && c.distance == 0) return false;
  const Vector bc = cross(b.normal, c.normal), ca = cross(c.normal, a.normal), ab = cross(a.normal, b.normal);
  Vector sum;
  for (std::size_t i = 0; i < 3; ++i)
    sum[i] = (a.distance * bc[i]) + (b.distance * ca[i]) + (c.distance * ab[i]);
  const double determinant = dot(a.normal, bc), most = most_tolerances * tolerance_;
  return dot(sum, sum) > most * most * determinant * determinant;
}

bool FacetCorners::moves(std::uint32_t corner, std::vector<Miss>& misses) const {
  find_misses(corner, misses);
  if (std::all_of(misses.begin(), misses.end(), [](const Miss& miss) { return miss.distance == 0; }))
    return false;
  if (misses.size() > most_at_a_corner) return true;
  for (std::size_t i = 0; i < misses.size(); ++i)
    for (std::size_t j = i + 1; j < misses.size(); ++j) {
      if (two_part(misses[i], misses[j])) return true;
      for (std::size_t k = j + 1; k < misses.size(); ++k)
        if (three_part(misses[i], misses[j], misses[k])) return true;
    }
  return false;
}

std::vector<Mesh::Moved> FacetCorners::moved() const {
  std::vector<Mesh::Moved> result;
  for (std::size_t facet = 0; facet < facets_.planes.size() && !offset_.empty(); ++facet) {
    if (is_own(facet)) continue;
    const geometry::HyperplaneId id = facets_.planes[facet].id();
    const auto h = table_.rounded(id);
    double distance = 0;
    for (const std::uint32_t corner : facets_.shape.triangles[facet])
      distance = std::max(distance, std::fabs(h.at(place(corner))));
    if (distance > h.error) result.push_back({id, distance});
  }
  std::sort(result.begin(), result.end(), [](const Mesh::Moved& a, const Mesh::Moved& b) {
    return a.plane != b.plane ? a.plane < b.plane : a.distance > b.distance;
  });
  const auto end = std::unique(result.begin(), result.end(),
                               [](const Mesh::Moved& a, const Mesh::Moved& b) { return a.plane == b.plane; });
  result.erase(end, result.end());
  return result;
}

bool FacetCorners::stay() const {
  std::vector<Miss> misses;
  for (std::uint32_t corner = 0; corner + 1 < offset_.size(); ++corner)
    if (moves(corner, misses)) return false;
  return true;
}

void FacetCorners::keep(geometry::HyperplaneTable<3>::Unmerging& unmerge) {
  std::vector<Miss> misses;
  std::vector<std::uint32_t> corners(offset_.empty() ? 0 : offset_.size() - 1);  // to be looked at
  std::iota(corners.rbegin(), corners.rend(), 0U);
  std::vector<Represented> represented;
  for (std::uint32_t facet = 0; facet < facets_.planes.size(); ++facet)
    if (!is_own(facet)) represented.push_back({facets_.planes[facet].id(), facet});
  std::ranges::sort(represented);
  while (!corners.empty()) {
    const std::uint32_t corner = corners.back();
    corners.pop_back();
    if (!moves(corner, misses)) continue;
    for (const Miss& miss : misses)
      if (miss.distance != 0)
        set_apart(std::ranges::equal_range(represented, miss.id, {}, &Represented::by), unmerge, corners);
  }
}

std::size_t FacetCorners::tilted() const {
  std::size_t count = 0;
  for (std::size_t facet = 0; facet < facets_.planes.size() && !offset_.empty(); ++facet)
    count += is_tilted(facet) ? 1 : 0;
  return count;
}

void FacetCorners::part_few(const std::vector<bool>& shared,
                            geometry::HyperplaneTable<3>::Unmerging& unmerge) {
  if (tilted() > facets_.planes.size() / facets_a_chance) return;
  for (std::uint32_t facet = 0; facet < facets_.planes.size(); ++facet) {
    auto& plane = facets_.planes[facet];
    if (is_tilted(facet) && !shared[plane.id()])
      plane = unmerge({facets_.map, facets_.first_covector + facet});
  }
}

/// All facets that a hyperplane represents: if some of a flat face had hyperplanes of their own, there would
/// be cells as thin as these are apart between them and the one that represents the others.
/// @param corners get those of the facets.
void FacetCorners::set_apart(std::span<const Represented> facets,
                             geometry::HyperplaneTable<3>::Unmerging& unmerge,
                             std::vector<std::uint32_t>& corners) {
  for (const auto& [by, facet] : facets) {
    auto& plane = facets_.planes[facet];
    if (plane.id() != by) continue;
    plane = unmerge({facets_.map, facets_.first_covector + facet});
    if (plane.id() == by) continue;  // it is exactly equal
    for (const std::uint32_t corner : facets_.shape.triangles[facet]) corners.push_back(corner);
  }
}

}  // namespace bsp2::dataflow
