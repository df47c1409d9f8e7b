#include "complex/plane_overlay.hpp"

#include <algorithm>
#include <limits>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

using geometry::HyperplaneId;
using geometry::OrientedHyperplane;

int PlaneOverlay::side(std::uint32_t point, OrientedHyperplane plane,
                       const geometry::Hyperplane<3>& rounded) {
  const std::size_t known = points_.size();
  const int side = point < known ? exact_.side(points_, point, plane.id(), rounded)
                                 : exact_.side(result_->points, point - known, plane.id(), rounded);
  return plane.flipped() ? -side : side;
}

/// Most facets are those of two cells that one split made and none has changed since.
void PlaneOverlay::take_equal(std::span<const std::uint32_t> on_plane) {
  const auto hash_of = [&](std::uint32_t facet) {
    std::uint64_t sum = 0;
    for (const PolygonCorner& corner : facets_.polygon(facet)) {
      const std::uint64_t hash = (corner.point + 1) * 0x9e3779b97f4a7c15u;
      sum += hash ^ hash >> 29;
    }
    return sum;
  };
  hashes_.clear();
  rest_.clear();
  for (const std::uint32_t facet : on_plane)
    if (!facets_.facets[facet].positive) hashes_.emplace_back(hash_of(facet), facet);
  if (hashes_.empty() || hashes_.size() == on_plane.size()) {
    rest_.assign(on_plane.begin(), on_plane.end());
    return;
  }
  std::sort(hashes_.begin(), hashes_.end());
  for (const std::uint32_t facet : on_plane) {
    if (!facets_.facets[facet].positive) continue;
    const std::uint64_t hash = hash_of(facet);
    auto at = std::lower_bound(hashes_.begin(), hashes_.end(), Hash(hash, 0));
    while (at != hashes_.end() && at->first == hash && (at->second == none || !are_equal(at->second, facet)))
      ++at;
    if (at == hashes_.end() || at->first != hash) {
      rest_.push_back(facet);
      continue;
    }
    const CellFacets::Facet& negative = facets_.facets[at->second];
    result_->pieces.push_back({negative.cell, facets_.facets[facet].cell, plane_, negative.begin,
                               static_cast<std::uint32_t>(facets_.polygon(at->second).size())});
    at->second = none;
  }
  for (const auto& [hash, facet] : hashes_)
    if (facet != none) rest_.push_back(facet);
}

bool PlaneOverlay::are_equal(std::uint32_t facet, std::uint32_t other) const {
  const auto a = facets_.polygon(facet), b = facets_.polygon(other);
  const std::size_t n = a.size();
  if (b.size() != n) return false;
  std::size_t first = 0;
  while (first < n && b[first].point != a[0].point) ++first;
  for (std::size_t i = 0; i < n && first < n; ++i)
    if (b[(first + i) % n].point != a[i].point) return false;
  return first < n;
}

void PlaneOverlay::run(std::span<const std::uint32_t> on_plane, Result& result) {
  result_ = &result;
  ++round_;
  crossing_count_ = 0;
  plane_ = facets_.planes[facets_.facets[on_plane[0]].plane];
  take_equal(on_plane);
  const auto is_positive = [&](std::uint32_t facet) { return facets_.facets[facet].positive; };
  if (std::ranges::all_of(rest_, is_positive) || std::ranges::none_of(rest_, is_positive)) {
    for (const std::uint32_t facet : rest_) add_rest(facet);
    return;
  }
  shared_.clear();
  sweep(find_boxes());
  for (const auto& side : sides_)
    for (const Facet& facet : side) {
      if (facet.is_covered) continue;
      if (facet.shared == none)
        add_rest(facet.source);
      else if (!is_shared_out(facet))
        add_what_is_left(facet);
    }
}

/// A facet that no other cell touches.
void PlaneOverlay::add_rest(std::uint32_t source) {
  const CellFacets::Facet& facet = facets_.facets[source];
  const auto count = static_cast<std::uint32_t>(facets_.polygon(source).size());
  const std::int32_t negative = facet.positive ? Complex::outside : facet.cell;
  result_->pieces.push_back(
      {negative, facet.positive ? facet.cell : Complex::outside, plane_, facet.begin, count});
}

void PlaneOverlay::add_piece(std::int32_t negative, std::int32_t positive,
                             std::span<const PolygonCorner> polygon) {
  result_->pieces.push_back({negative, positive, plane_,
                             static_cast<std::uint32_t>(facets_.corners.size() + result_->corners.size()),
                             static_cast<std::uint32_t>(polygon.size())});
  result_->corners.insert(result_->corners.end(), polygon.begin(), polygon.end());
}

/// Facets by the axis along which all extend farthest. @return what boxes may be off by.
double PlaneOverlay::find_boxes() {
  double slack = 0;
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (auto& side : sides_) side.clear();
  for (const std::uint32_t source : rest_) {
    auto& side = sides_[facets_.facets[source].positive ? 1 : 0];
    Facet& facet = side.emplace_back(Facet{source, {}, {}});
    facet.low.fill(std::numeric_limits<double>::infinity());
    facet.high.fill(-std::numeric_limits<double>::infinity());
    for (const PolygonCorner& corner : facets_.polygon(source)) {
      const auto& vertex = points_.vertices[corner.point];
      slack = std::max(slack, 4 * vertex.error);
      for (std::size_t k = 0; k < 3; ++k) {
        facet.low[k] = std::min(facet.low[k], vertex.x[k]);
        facet.high[k] = std::max(facet.high[k], vertex.x[k]);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], facet.low[k]);
      high[k] = std::max(high[k], facet.high[k]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  axis_ = axis;
  for (auto& side : sides_)
    std::sort(side.begin(), side.end(),
              [axis](const Facet& a, const Facet& b) { return a.low[axis] < b.low[axis]; });
  return slack;
}

void PlaneOverlay::sweep(double slack) {
  std::array<std::size_t, 2> next{};
  for (auto& active : active_) active.clear();
  const auto& sides = sides_;
  while (next[0] < sides[0].size() || next[1] < sides[1].size()) {
    geometry::Interruption::check();
    const int which =
        next[1] >= sides[1].size() ||
                (next[0] < sides[0].size() && sides[0][next[0]].low[axis_] <= sides[1][next[1]].low[axis_])
            ? 0
            : 1;
    Facet& facet = sides_[which][next[which]++];
    std::erase_if(active_[1 - which], [&](const Facet* other) {
      return other->is_covered || other->high[axis_] + slack < facet.low[axis_];
    });
    for (Facet* other : active_[1 - which]) {
      if (facet.is_covered) break;
      bool boxes_meet = true;
      for (std::size_t k = 0; k < 3 && boxes_meet; ++k)
        boxes_meet = facet.low[k] <= other->high[k] + slack && other->low[k] <= facet.high[k] + slack;
      if (boxes_meet) which == 0 ? meet(facet, *other) : meet(*other, facet);
    }
    active_[which].push_back(&facet);
  }
}

/// How much of a polygon is within another one; `some` where no single edge tells.
PlaneOverlay::Overlap PlaneOverlay::overlap(std::span<const PolygonCorner> polygon,
                                            std::span<const PolygonCorner> within) {
  bool has_outer = false;
  for (const PolygonCorner& edge : within) {
    const auto rounded = exact_.table().rounded(edge.across.id());
    bool has_inner = false;
    for (const PolygonCorner& corner : polygon) {
      const int s = side(corner.point, edge.across, rounded);
      has_inner = has_inner || s < 0;
      has_outer = has_outer || s > 0;
      if (has_inner && has_outer) break;
    }
    if (!has_inner) return Overlap::none;
  }
  return has_outer ? Overlap::some : Overlap::all;
}

void PlaneOverlay::meet(Facet& negative, Facet& positive) {
  const auto n = facets_.polygon(negative.source), p = facets_.polygon(positive.source);
  const Overlap of_negative = overlap(n, p);
  if (of_negative == Overlap::none) return;
  const Overlap of_positive = overlap(p, n);
  if (of_positive == Overlap::none) return;
  const auto& whole = of_negative == Overlap::all || of_positive != Overlap::all ? n : p;
  common_.assign(whole.begin(), whole.end());
  if (of_negative == Overlap::some && of_positive == Overlap::some)
    for (const PolygonCorner& edge : p) {
      cut(common_, edge.across, inner_, outer_);
      if (!outer_.empty()) common_.swap(inner_);
    }
  for (const auto& [facet, overlap] : {std::pair(&negative, of_negative), std::pair(&positive, of_positive)})
    if (overlap == Overlap::all) {
      facet->is_covered = true;
    } else {
      shared_.push_back({static_cast<std::uint32_t>(result_->pieces.size()), facet->shared});
      facet->shared = static_cast<std::uint32_t>(shared_.size() - 1);
    }
  add_piece(facets_.facets[negative.source].cell, facets_.facets[positive.source].cell, common_);
}

/// Where these lines are, or would be.
PlaneOverlay::Crossing& PlaneOverlay::place_of(std::uint64_t lines) {
  const std::size_t mask = crossings_.size() - 1;
  std::size_t at = (lines ^ lines >> 29) * 0x9e3779b97f4a7c15u >> 32 & mask;
  while (crossings_[at].round == round_ && crossings_[at].lines != lines) at = (at + 1) & mask;
  return crossings_[at];
}

/// The point of the plane in which two lines meet, each on another plane.
std::uint32_t PlaneOverlay::crossing(HyperplaneId a, HyperplaneId b) {
  if (2 * crossing_count_ >= crossings_.size()) {
    std::vector<Crossing> before(std::max<std::size_t>(2 * crossings_.size(), 64));
    before.swap(crossings_);
    for (const Crossing& entry : before)
      if (entry.round == round_) place_of(entry.lines) = entry;
  }
  const std::uint64_t lines = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  Crossing& entry = place_of(lines);
  if (entry.round != round_) {
    ++crossing_count_;
    std::array<HyperplaneId, 3> ids{plane_, a, b};
    std::sort(ids.begin(), ids.end());
    entry = {lines, named_.known(ids), round_};
    if (entry.point == PointRegister::none) {
      entry.point = static_cast<std::uint32_t>(points_.size() + result_->points.size());
      result_->points.add(geometry::canonical_vertex(exact_.table(), ids), ids);
    }
  }
  return entry.point;
}

/// Divides a convex polygon by a line of the plane. @param outer empty if nothing is beyond it; then `inner`
/// is not made. @param inner empty if all is.
/// Source: Sutherland, Hodgman, "Reentrant polygon clipping" (1974).
void PlaneOverlay::cut(const Polygon& polygon, OrientedHyperplane by, Polygon& inner, Polygon& outer) {
  inner.clear();
  outer.clear();
  signs_.clear();
  bool has_inner = false, has_outer = false;
  const auto rounded = exact_.table().rounded(by.id());
  for (const PolygonCorner& corner : polygon) {
    signs_.push_back(side(corner.point, by, rounded));
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
      const std::uint32_t point = crossing(corner.across.id(), by.id());
      inner.push_back({point, here < 0 ? by : corner.across});
      outer.push_back({point, here > 0 ? by.opposite() : corner.across});
    }
  }
}

std::span<const PolygonCorner> PlaneOverlay::corners_of(const PlanePiece& piece) const {
  const std::size_t known = facets_.corners.size();
  const PolygonCorner* first = piece.begin < known ? facets_.corners.data() + piece.begin
                                                   : result_->corners.data() + (piece.begin - known);
  return {first, piece.count};
}

/// Whether nothing is left of a facet but what it shares: then the edges of all that and the facet's own ones
/// cancel, line by line. Edges along one line add up to nothing if their ends do. If not, a line may have two
/// names, and nothing is left all the same.
bool PlaneOverlay::is_shared_out(const Facet& facet) {
  line_ends_.clear();
  add_line_ends(facets_.polygon(facet.source), 1);
  for (std::uint32_t at = facet.shared; at != none; at = shared_[at].earlier)
    add_line_ends(corners_of(result_->pieces[shared_[at].piece]), -1);
  std::sort(line_ends_.begin(), line_ends_.end());
  for (std::size_t begin = 0, end = 0; begin < line_ends_.size(); begin = end) {
    int sum = 0;
    for (; end < line_ends_.size() && line_ends_[end].first == line_ends_[begin].first; ++end)
      sum += line_ends_[end].second;
    if (sum != 0) return false;
  }
  return true;
}

void PlaneOverlay::add_line_ends(std::span<const PolygonCorner> polygon, int way) {
  std::uint32_t before = polygon.back().across.id();
  for (const auto& [point, across] : polygon) {
    line_ends_.emplace_back(std::uint64_t{before} << 32 | point, way);
    before = across.id();
    line_ends_.emplace_back(std::uint64_t{before} << 32 | point, -way);
  }
}

const geometry::Vertex<3>& PlaneOverlay::vertex(std::uint32_t point) const {
  const std::size_t known = points_.size();
  return point < known ? points_.vertices[point] : result_->points.vertices[point - known];
}

/// What is taken away first decides how the rest is divided. That shall not depend on what else is on the
/// plane, so it goes by where pieces are, and what their corners are called.
void PlaneOverlay::sort_by_corners(std::vector<std::uint32_t>& pieces) const {
  using Key = std::pair<std::array<double, 3>, std::array<HyperplaneId, 3>>;
  std::vector<std::pair<std::vector<Key>, std::uint32_t>> keys;
  for (const std::uint32_t piece : pieces) {
    auto& [corners, number] = keys.emplace_back();
    number = piece;
    for (const PolygonCorner& corner : corners_of(result_->pieces[piece])) {
      const geometry::Vertex<3>& v = vertex(corner.point);
      corners.emplace_back(v.x, v.hyperplanes);
    }
    std::sort(corners.begin(), corners.end());
  }
  std::sort(keys.begin(), keys.end());
  for (std::size_t i = 0; i < pieces.size(); ++i) pieces[i] = keys[i].second;
}

void PlaneOverlay::add_what_is_left(const Facet& facet) {
  std::vector<std::uint32_t> pieces;
  for (std::uint32_t at = facet.shared; at != none; at = shared_[at].earlier)
    pieces.push_back(shared_[at].piece);
  sort_by_corners(pieces);
  const auto whole = facets_.polygon(facet.source);
  left_.assign(1, Polygon(whole.begin(), whole.end()));
  for (std::size_t i = 0; i < pieces.size() && !left_.empty(); ++i)
    subtract(corners_of(result_->pieces[pieces[i]]));
  const CellFacets::Facet& source = facets_.facets[facet.source];
  for (const Polygon& polygon : left_)
    source.positive ? add_piece(Complex::outside, source.cell, polygon)
                    : add_piece(source.cell, Complex::outside, polygon);
}

/// Takes a polygon away from what is left of a facet. Where its cycle begins depends on who wrote the cell.
void PlaneOverlay::subtract(std::span<const PolygonCorner> polygon) {
  const auto lowest = std::min_element(polygon.begin(), polygon.end(), [&](const auto& a, const auto& b) {
    const geometry::Vertex<3>&u = vertex(a.point), &v = vertex(b.point);
    return u.x != v.x ? u.x < v.x : u.hyperplanes < v.hyperplanes;
  });
  const auto first = static_cast<std::size_t>(lowest - polygon.begin());
  std::vector<Polygon> left;
  for (Polygon& piece : left_) {
    if (overlap(piece, polygon) == Overlap::none) {
      left.push_back(std::move(piece));
      continue;
    }
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      cut(piece, polygon[(first + k) % polygon.size()].across, inner_, outer_);
      if (outer_.empty()) continue;
      left.push_back(outer_);
      piece.swap(inner_);
      if (piece.empty()) break;  // the two only touch after all
    }
  }
  left_ = std::move(left);
}

}  // namespace bsp2::meshing
