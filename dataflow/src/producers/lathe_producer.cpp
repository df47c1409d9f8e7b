#include "producers/lathe_producer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "producers/convex_producer.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

namespace {

constexpr std::size_t range_words = 5;  // caps, first band, bands, first side, sides
constexpr Word cap_bit(std::size_t cap) { return Word{1} << cap; }

}  // namespace

LatheProducer::Range LatheProducer::range_of(const Word* leaf) const {
  if ((leaf[0] & Program::whole) != 0) return whole();
  const Word* state = leaf + Program::header;
  return {state[1], state[2], state[3], state[4]};
}

Label LatheProducer::ask(const Word* leaf, CellView<3>& cell, Words& out) const {
  if ((leaf[0] & (Program::whole | Program::ranged)) == 0)
    return ConvexProducer<3>(network_, producer_).ask(leaf, cell, out);
  const bool is_whole = (leaf[0] & Program::whole) != 0;
  if (cell.box_test_only() && is_whole && cell.extent().contains(producer_)) {
    out.append({leaf, Program::header});
    return Label::fuzzy;
  }
  const std::size_t begin = out.size();
  out.push(leaf[0] & ~(Program::whole | Program::ranged), 0, leaf[2]);
  Word caps = 0;
  for (std::size_t cap = 0; cap < lathe_.caps.size(); ++cap) {
    if (!is_whole && (leaf[Program::header] & cap_bit(cap)) == 0) continue;
    const Position where = cell.position({lathe_.caps[cap]});
    if (where == Position::positive) return Label::out;
    if (where == Position::crossing) caps |= cap_bit(cap);
  }
  Range range = range_of(leaf);
  const Place at = place(cell);
  tighten(range, cell, at);
  if (is_outside(at)) return Label::out;
  if (is_within_sides(at)) range.sides = 0;
  if (size(range) > few_facets && (cell.box_test_only() || parting(range, cell))) {
    out[begin] |= Program::ranged;
    out.push(caps, range.first_band, range.bands, range.first_side, range.sides);
    return Label::fuzzy;
  }
  for (std::size_t cap = 0; cap < lathe_.caps.size(); ++cap)
    if ((caps & cap_bit(cap)) != 0) out.push(lathe_.caps[cap]);
  const OrientedHyperplane* const facets =
      network_.planes.data() + producer_.first_plane + lathe_.caps.size();
  for (std::uint32_t k = 0; k < range.sides; ++k) {
    const std::size_t side = (range.first_side + k) % lathe_.sides;
    for (std::uint32_t band = range.first_band; band < range.first_band + range.bands; ++band) {
      const OrientedHyperplane plane = facets[side * lathe_.bands + band];
      const Position where = cell.position(plane);
      if (where == Position::positive) return Label::out;
      if (where == Position::crossing) out.push(plane.code);
    }
  }
  return out.size() == begin + Program::header ? Label::in : Label::fuzzy;
}

std::size_t LatheProducer::undecided(const Word* leaf) const {
  if ((leaf[0] & (Program::whole | Program::ranged)) == 0)
    return ConvexProducer<3>(network_, producer_).undecided(leaf);
  return size(range_of(leaf)) + lathe_.caps.size();
}

/// A cut that halves the range; between few facets, what a convex polytope advises.
Advice LatheProducer::advise(const Word* leaf, CellView<3>& cell) const {
  if ((leaf[0] & Program::ranged) != 0)
    if (const auto cut = parting(range_of(leaf), cell)) return {geometry::oriented(*cut)};
  return ConvexProducer<3>(network_, producer_).advise(leaf, cell);
}

// --- where a cell is ---

LatheProducer::Place LatheProducer::place(const CellView<3>& view) const {
  const auto vertices = view.cell().vertices();
  double error = 0;
  std::array<double, 2> middle{};
  std::vector<std::array<double, 3>> points;
  points.reserve(vertices.size());
  for (const auto& vertex : vertices) {
    std::array<double, 3> p;
    for (int i = 0; i < 3; ++i)
      p[i] = lathe_.to_frame[i][0] * vertex.x[0] + lathe_.to_frame[i][1] * vertex.x[1] +
             lathe_.to_frame[i][2] * vertex.x[2] + lathe_.to_frame[i][3];
    error = std::max(error, vertex.error);
    middle[0] += p[0];
    middle[1] += p[1];
    points.push_back(p);
  }
  error = error * lathe_.frame_scale + lathe_.frame_error + lathe_.slack;
  Place place{points[0][2], points[0][2], 0, 0, std::nullopt};
  for (const auto& p : points) {
    place.low = std::min(place.low, p[2]);
    place.high = std::max(place.high, p[2]);
    place.farthest = std::max(place.farthest, std::hypot(p[0], p[1]));
  }
  place.low -= error;
  place.high += error;
  place.farthest = place.farthest * (1 + 0x1p-48) + error;
  const double length = std::hypot(middle[0], middle[1]);
  if (!(length > 0)) return place;
  const double c = middle[0] / length, s = middle[1] / length;
  double nearest = place.farthest, left = 0, right = 0;
  for (const auto& p : points) nearest = std::min(nearest, c * p[0] + s * p[1]);
  // Only a cell that lies well on one side of a plane through the axis spans less than half a turn for
  // certain.
  if (nearest < 16 * error || nearest < 0x1p-40 * place.farthest) return place;
  for (const auto& p : points) {
    const double angle = std::atan2(c * p[1] - s * p[0], c * p[0] + s * p[1]);
    left = std::min(left, angle);
    right = std::max(right, angle);
  }
  const double direction = std::atan2(s, c), doubt = 2 * error / nearest + 0x1p-46;
  place.nearest = nearest * (1 - 0x1p-48) - error;
  place.angle = {direction + left - doubt, direction + right + doubt};
  return place;
}

/// Keeps the facets of the range that matter to the cell: those within its angles and heights. What the
/// cell's own facets say about that is exact: they may be planes that part the lathe's.
void LatheProducer::tighten(Range& range, const CellView<3>& view, const Place& place) const {
  const auto& cell = view.cell();
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    const OrientedHyperplane plane = cell.facet_hyperplane(facet);
    const auto known = std::lower_bound(lathe_.by_id.begin(), lathe_.by_id.end(), plane.id(),
                                        [](const auto& entry, HyperplaneId id) { return entry.first < id; });
    if (known == lathe_.by_id.end() || known->first != plane.id()) continue;
    const Lathe::SplitPosition& parting = known->second;
    const bool positive =
        parting.plane.flipped() != plane.flipped();  // the cell is on the negative side of `plane`
    if (!parting.axial) {
      meet_bands(range, positive ? parting.at : 0, positive ? lathe_.bands : parting.at);
    } else {
      const std::uint32_t half = (lathe_.sides + 1) / 2;
      meet_sides(range, positive ? parting.at : (parting.at + lathe_.sides - half) % lathe_.sides, half);
    }
  }
  const auto ring_above = [&](double z) {
    return static_cast<std::uint32_t>(std::upper_bound(lathe_.z.begin(), lathe_.z.end(), z) -
                                      lathe_.z.begin());
  };
  const std::uint32_t low = std::clamp(ring_above(place.low), 1U, lathe_.bands),
                      high = std::clamp(ring_above(place.high), 1U, lathe_.bands);
  meet_bands(range, low - 1, high);
  if (!place.angle) return;
  const double per_turn = lathe_.sides / (2 * std::numbers::pi), doubt = 1e-15 * lathe_.sides;
  const double first = std::floor((*place.angle)[0] * per_turn - doubt),
               last = std::floor((*place.angle)[1] * per_turn + doubt);
  const double sides = lathe_.sides;
  if (last - first + 1 < sides)
    meet_sides(
        range,
        static_cast<std::uint32_t>(static_cast<std::int64_t>(first - sides * std::floor(first / sides))) %
            lathe_.sides,
        static_cast<std::uint32_t>(last - first + 1));
}

void LatheProducer::meet_bands(Range& range, std::uint32_t first, std::uint32_t end) const {
  const std::uint32_t own_end = range.first_band + range.bands;
  first = std::max(first, range.first_band);
  end = std::min(end, own_end);
  if (first >= end) return;  // only by rounding: the larger range is right, too
  range.first_band = first;
  range.bands = end - first;
}

/// Meets the sides with an arc. Where two arcs would be left, the range stays: it may always be too large.
void LatheProducer::meet_sides(Range& range, std::uint32_t first, std::uint32_t count) const {
  const std::uint32_t n = lathe_.sides;
  if (count >= n) return;
  if (range.sides == n) {
    range.first_side = first;
    range.sides = count;
    return;
  }
  const std::uint32_t ahead = (first + n - range.first_side) % n;  // from the range's begin to the arc's
  const bool wraps = ahead + count > n;                            // the arc goes past the range's begin
  if (ahead < range.sides) {
    if (wraps && ahead + count - n > 0) return;
    range.first_side = first;
    range.sides = std::min(range.sides - ahead, count);
  } else if (wraps) {
    range.sides = std::min(range.sides, ahead + count - n);
  }
}

// --- tests of boxes alone ---

/// Radius of the corners at a height between the first and the last ring; concave.
double LatheProducer::profile(double z) const {
  z = std::clamp(z, lathe_.z.front(), lathe_.z.back());
  const std::size_t above = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::upper_bound(lathe_.z.begin(), lathe_.z.end(), z) - lathe_.z.begin()), 1,
      lathe_.bands);
  const double share = (z - lathe_.z[above - 1]) / (lathe_.z[above] - lathe_.z[above - 1]);
  return lathe_.radius[above - 1] + share * (lathe_.radius[above] - lathe_.radius[above - 1]);
}

/// Whether no corner at the cell's heights is as far from the axis as the cell's nearest point. Where the
/// cell is above or below the stack the caps answer.
bool LatheProducer::is_outside(const Place& place) const {
  if (!place.angle) return false;
  double widest = std::max(profile(place.low), profile(place.high));
  if (place.low < lathe_.z[lathe_.widest] && lathe_.z[lathe_.widest] < place.high)
    widest = lathe_.radius[lathe_.widest];
  return place.nearest > widest * (1 + 0x1p-45);
}

/// Whether all sides, at the cell's heights, are farther from the axis than its farthest point.
bool LatheProducer::is_within_sides(const Place& place) const {
  const double narrowest = std::min(profile(place.low), profile(place.high));
  return place.farthest < narrowest * std::cos(std::numbers::pi / lathe_.sides) * (1 - 0x1p-45);
}

/// The parting plane nearest to the middle of the range that crosses the cell; sides are parted or bands,
/// whichever are more numerous.
std::optional<HyperplaneId> LatheProducer::parting(const Range& range, CellView<3>& cell) const {
  const auto nearest = [&](const std::vector<Lathe::SplitPosition>& planes, std::uint32_t target,
                           auto&& is_within) -> std::optional<HyperplaneId> {
    if (planes.empty()) return std::nullopt;
    const auto above = std::lower_bound(
        planes.begin(), planes.end(), target,
        [](const Lathe::SplitPosition& parting, std::uint32_t at) { return parting.at < at; });
    const auto middle = static_cast<std::size_t>(above - planes.begin()) % planes.size();
    for (const std::size_t step : {std::size_t{0}, planes.size() - 1, std::size_t{1}, planes.size() / 4}) {
      const Lathe::SplitPosition& parting = planes[(middle + step) % planes.size()];
      if (is_within(parting.at) && cell.crosses(parting.plane.id())) return parting.plane.id();
    }
    return std::nullopt;
  };
  const auto of_sides = [&] {
    const bool around = range.sides == lathe_.sides;
    return nearest(lathe_.axial, (range.first_side + range.sides / 2) % lathe_.sides, [&](std::uint32_t at) {
      const std::uint32_t ahead = (at + lathe_.sides - range.first_side) % lathe_.sides;
      return around || (ahead > 0 && ahead < range.sides);
    });
  };
  const auto of_bands = [&] {
    return nearest(lathe_.level, range.first_band + range.bands / 2, [&](std::uint32_t at) {
      return at > range.first_band && at < range.first_band + range.bands;
    });
  };
  const bool sides_first =
      std::size_t{range.sides} * lathe_.bands_between >= std::size_t{range.bands} * lathe_.sides_between;
  if (const auto found = sides_first ? of_sides() : of_bands()) return found;
  return sides_first ? of_bands() : of_sides();
}

}  // namespace bsp2::dataflow

static_assert(bsp2::dataflow::ProducerProcess<bsp2::dataflow::LatheProducer, 3>);
