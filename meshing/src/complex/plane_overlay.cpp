#include "complex/plane_overlay.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

using geometry::HyperplaneId;
using geometry::OrientedHyperplane;

/// Where these planes are, or would be.
PointRegister::Entry& PointRegister::place_of(const std::array<HyperplaneId, 3>& ids) {
  std::uint64_t hash = ids[0];
  for (int k = 1; k < 3; ++k) hash = (hash ^ hash >> 31) * 0x9e3779b97f4a7c15u + ids[k];
  const std::size_t mask = known_.size() - 1;
  std::size_t at = (hash ^ hash >> 29) * 0x9e3779b97f4a7c15u >> 32 & mask;
  while (known_[at].point != ~0U && known_[at].ids != ids) at = (at + 1) & mask;
  return known_[at];
}

void PointRegister::grow() {
  std::vector<Entry> before(std::max<std::size_t>(2 * known_.size(), 1024));
  before.swap(known_);
  for (const Entry& entry : before)
    if (entry.point != ~0U) place_of(entry.ids) = entry;
}

std::uint32_t PointRegister::find(HyperplaneId a, HyperplaneId b, HyperplaneId c) {
  std::array<HyperplaneId, 3> ids{a, b, c};
  std::sort(ids.begin(), ids.end());
  if (2 * count_ >= known_.size()) grow();
  Entry& entry = place_of(ids);
  if (entry.point == ~0U) {
    ++count_;
    entry = {ids, static_cast<std::uint32_t>(points_.size())};
    points_.add(geometry::canonical_vertex(exact_.table(), ids), ids);
  }
  return entry.point;
}

std::vector<std::uint32_t> PointRegister::unify() {
  const std::vector<std::uint32_t> map = exact_.unify(points_);
  for (Entry& entry : known_)
    if (entry.point != ~0U) entry.point = map[entry.point];
  return map;
}

int PlaneOverlay::side(std::uint32_t point, OrientedHyperplane plane) {
  const int side = exact_.side(points_.points(), point, plane.id());
  return plane.flipped() ? -side : side;
}

/// Most facets are those of two cells that one split made and none has changed since.
void PlaneOverlay::take_equal(std::vector<PlaneFacet>& facets, std::vector<PlanePiece>& pieces) const {
  const auto hash_of = [](const Polygon& polygon) {
    std::uint64_t sum = 0;
    for (const PolygonCorner& corner : polygon) {
      const std::uint64_t hash = (corner.point + 1) * 0x9e3779b97f4a7c15u;
      sum += hash ^ hash >> 29;
    }
    return sum;
  };
  const auto are_equal = [](const Polygon& a, const Polygon& b) {
    const std::size_t n = a.size();
    if (b.size() != n) return false;
    std::size_t first = 0;
    while (first < n && b[first].point != a[0].point) ++first;
    for (std::size_t i = 0; i < n && first < n; ++i)
      if (b[(first + i) % n].point != a[i].point) return false;
    return first < n;
  };
  std::vector<std::pair<std::uint64_t, std::size_t>> hashes;
  for (std::size_t i = 0; i < facets.size(); ++i)
    if (!facets[i].positive) hashes.emplace_back(hash_of(facets[i].polygon), i);
  std::sort(hashes.begin(), hashes.end());
  for (PlaneFacet& positive : facets) {
    if (!positive.positive) continue;
    const std::uint64_t hash = hash_of(positive.polygon);
    for (auto at = std::lower_bound(hashes.begin(), hashes.end(), std::pair(hash, std::size_t{0}));
         at != hashes.end() && at->first == hash; ++at) {
      PlaneFacet& negative = facets[at->second];
      if (!are_equal(negative.polygon, positive.polygon)) continue;
      pieces.push_back({negative.cell, positive.cell, std::exchange(negative.polygon, {})});
      positive.polygon.clear();
      break;
    }
  }
  std::erase_if(facets, [](const PlaneFacet& facet) { return facet.polygon.empty(); });
}

void PlaneOverlay::run(HyperplaneId plane, std::vector<PlaneFacet>& facets, std::vector<PlanePiece>& pieces) {
  plane_ = plane;
  take_equal(facets, pieces);
  std::array<std::vector<Facet>, 2> sides;
  double slack = 0;
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (PlaneFacet& source : facets) {
    Facet facet{&source, {}, {}, {}};
    facet.low.fill(std::numeric_limits<double>::infinity());
    facet.high.fill(-std::numeric_limits<double>::infinity());
    for (const PolygonCorner& corner : source.polygon) {
      const auto& vertex = points_.points().vertices[corner.point];
      slack = std::max(slack, 4 * vertex.error);
      for (int k = 0; k < 3; ++k) {
        facet.low[k] = std::min(facet.low[k], vertex.x[k]);
        facet.high[k] = std::max(facet.high[k], vertex.x[k]);
        low[k] = std::min(low[k], vertex.x[k]);
        high[k] = std::max(high[k], vertex.x[k]);
      }
    }
    facet.left.push_back(source.polygon);
    sides[source.positive ? 1 : 0].push_back(std::move(facet));
  }
  // Sweep along the axis in which the facets extend farthest.
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  for (auto& side : sides)
    std::sort(side.begin(), side.end(), [axis](const Facet& a, const Facet& b) {
      return std::pair(a.low[axis], a.source->cell) < std::pair(b.low[axis], b.source->cell);
    });
  std::array<std::vector<Facet*>, 2> active;
  std::array<std::size_t, 2> next{};
  while (next[0] < sides[0].size() || next[1] < sides[1].size()) {
    geometry::Interruption::check();
    const int which =
        next[1] >= sides[1].size() ||
                (next[0] < sides[0].size() && sides[0][next[0]].low[axis] <= sides[1][next[1]].low[axis])
            ? 0
            : 1;
    Facet& facet = sides[which][next[which]++];
    std::erase_if(active[1 - which], [&](const Facet* other) {
      return other->left.empty() || other->high[axis] + slack < facet.low[axis];
    });
    for (Facet* other : active[1 - which]) {
      if (facet.left.empty()) break;
      bool boxes_meet = true;
      for (int k = 0; k < 3 && boxes_meet; ++k)
        boxes_meet = facet.low[k] <= other->high[k] + slack && other->low[k] <= facet.high[k] + slack;
      if (boxes_meet) which == 0 ? meet(facet, *other, pieces) : meet(*other, facet, pieces);
    }
    active[which].push_back(&facet);
  }
  for (auto& side : sides)
    for (Facet& facet : side)
      for (Polygon& polygon : facet.left) {
        const std::int32_t cell = facet.source->cell;
        if (facet.source->positive)
          pieces.push_back({Complex::outside, cell, std::move(polygon)});
        else
          pieces.push_back({cell, Complex::outside, std::move(polygon)});
      }
}

/// How much of a polygon is within another one; `some` where no single edge tells.
PlaneOverlay::Overlap PlaneOverlay::overlap(const Polygon& polygon, const Polygon& within) {
  bool has_outer = false;
  for (const PolygonCorner& edge : within) {
    bool has_inner = false;
    for (const PolygonCorner& corner : polygon) {
      const int s = side(corner.point, edge.across);
      has_inner = has_inner || s < 0;
      has_outer = has_outer || s > 0;
      if (has_inner && has_outer) break;
    }
    if (!has_inner) return Overlap::none;
  }
  return has_outer ? Overlap::some : Overlap::all;
}

void PlaneOverlay::meet(Facet& negative, Facet& positive, std::vector<PlanePiece>& pieces) {
  const Polygon &n = negative.source->polygon, &p = positive.source->polygon;
  const Overlap of_negative = overlap(n, p);
  if (of_negative == Overlap::none) return;
  const Overlap of_positive = overlap(p, n);
  if (of_positive == Overlap::none) return;
  Polygon common = of_negative == Overlap::all ? n : p;
  if (of_negative == Overlap::some && of_positive == Overlap::some) {
    common = n;
    Polygon inner, outer;
    for (const PolygonCorner& edge : p) {
      cut(common, edge.across, inner, outer);
      if (!outer.empty()) common = inner;
    }
  }
  if (of_negative == Overlap::all)
    negative.left.clear();
  else
    subtract(negative, common);
  if (of_positive == Overlap::all)
    positive.left.clear();
  else
    subtract(positive, common);
  pieces.push_back({negative.source->cell, positive.source->cell, std::move(common)});
}

/// Divides a convex polygon by a line of the plane. @param outer empty if nothing is beyond it; then `inner`
/// is not made. @param inner empty if all is.
/// Source: Sutherland, Hodgman, "Reentrant polygon clipping" (1974).
void PlaneOverlay::cut(const Polygon& polygon, OrientedHyperplane by, Polygon& inner, Polygon& outer) {
  inner.clear();
  outer.clear();
  signs_.clear();
  bool has_inner = false, has_outer = false;
  for (const PolygonCorner& corner : polygon) {
    signs_.push_back(side(corner.point, by));
    has_inner = has_inner || signs_.back() < 0;
    has_outer = has_outer || signs_.back() > 0;
  }
  if (!has_outer) return;
  if (!has_inner) {
    outer = polygon;
    return;
  }
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const int here = signs_[i], next = signs_[i + 1 < signs_.size() ? i + 1 : 0];
    const PolygonCorner& corner = polygon[i];
    if (here <= 0) inner.push_back({corner.point, here == 0 && next > 0 ? by : corner.across});
    if (here >= 0) outer.push_back({corner.point, here == 0 && next < 0 ? by.opposite() : corner.across});
    if (here * next < 0) {
      const std::uint32_t point = points_.find(plane_, corner.across.id(), by.id());
      inner.push_back({point, here < 0 ? by : corner.across});
      outer.push_back({point, here > 0 ? by.opposite() : corner.across});
    }
  }
}

/// Takes a polygon away from what is left of a facet.
void PlaneOverlay::subtract(Facet& facet, const Polygon& polygon) {
  std::vector<Polygon> left;
  Polygon inner, outer;
  for (Polygon& piece : facet.left) {
    if (overlap(piece, polygon) == Overlap::none) {
      left.push_back(std::move(piece));
      continue;
    }
    for (const PolygonCorner& edge : polygon) {
      cut(piece, edge.across, inner, outer);
      if (outer.empty()) continue;
      left.push_back(std::exchange(outer, {}));
      piece = inner;
      if (piece.empty()) break;  // the two only touch after all
    }
  }
  facet.left = std::move(left);
}

}  // namespace bsp2::meshing
