#include "producers/torus_producer.hpp"

#include <algorithm>
#include <cmath>

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

TorusProducer::State TorusProducer::state_of(const Word* leaf) const {
  State state;
  if ((leaf[0] & Program::whole) != 0) return state;
  state.known = leaf[at_known] != 0;
  state.wedge = {leaf[at_face], leaf[at_level], {leaf[at_place]}};
  return state;
}

std::size_t TorusProducer::undecided(const Word* leaf) const {
  return 2 + 2 * std::size_t{state_of(leaf).wedge.level};
}

Label TorusProducer::ask(const Word* leaf, CellView<3>& cell, Words& out) const {
  State state = state_of(leaf);
  if (!cell.box_test_only()) {
    tighten(state, cell);
    if (state.known)
      if (const Label label = ask_vertices(state.wedge, cell); label != Label::fuzzy) return label;
  }
  out.push(leaf[0] & ~Program::whole, 0, leaf[2], state.known ? 1U : 0U, state.wedge.face, state.wedge.level,
           state.wedge.at[0]);
  return Label::fuzzy;
}

// --- the wedge ---

/// The quarter around the axis in which the cell's centre is.
TorusProducer::Wedge TorusProducer::quarter(const CellView<3>& cell) const {
  const Vector y = torus_.to_frame.image(cell.extent().centre);
  const int axis = std::fabs(y[1]) > std::fabs(y[0]) ? 1 : 0;
  return {static_cast<std::uint32_t>(2 * axis + (y[static_cast<std::size_t>(axis)] < 0 ? 1 : 0)), 0, {}};
}

bool TorusProducer::is_within(const Wedge& wedge, CellView<3>& cell) const {
  return cell.position(torus_.radial(torus_.fan.bound(wedge, 0, 1))) == Position::negative &&
         cell.position(torus_.radial(torus_.fan.bound(wedge, 0, -1))) == Position::positive;
}

void TorusProducer::tighten(State& state, CellView<3>& cell) const {
  if (!state.known) {
    state.wedge = quarter(cell);
    state.known = is_within(state.wedge, cell);
    if (!state.known) state.wedge = {};
  }
  while (state.known && state.wedge.level < torus_.levels()) {
    const Position where = cell.position(torus_.radial(torus_.fan.halving(state.wedge, 0)));
    if (where == Position::crossing) return;
    ++state.wedge.level;
    state.wedge.at[0] = 2 * state.wedge.at[0] + (where == Position::positive ? 1 : 0);
  }
}

// --- asking ---

std::vector<TorusProducer::Place> TorusProducer::places(const Wedge& wedge, const CellView<3>& cell) const {
  const auto d = geometry::TorusFamily::direction(wedge);
  const auto [least, most] = geometry::TorusFamily::span(wedge);
  std::vector<Place> places;
  for (const auto& vertex : cell.cell().vertices()) {
    const Vector y = torus_.to_frame.image(vertex.x);
    const double along = d[0] * y[0] + d[1] * y[1];
    places.push_back({along * least, along * most, y[2]});
  }
  return places;
}

/// In a wedge `least` and `most` are linear in the point. So a cell is inside if all vertices are, with both
/// in the place of the distance to the axis; and outside if all are beyond one line across the tube, with the
/// one that is nearer to it.
Label TorusProducer::ask_vertices(const Wedge& wedge, const CellView<3>& cell) const {
  if (!std::isfinite(torus_.to_frame.error)) return Label::fuzzy;
  double error = 0, far = 1;
  for (const auto& vertex : cell.cell().vertices()) error = std::max(error, vertex.error);
  const auto at = places(wedge, cell);
  for (const Place& place : at) far = std::max({far, std::fabs(place.most), std::fabs(place.z)});
  // `most` is at most 1.5 times the length of (x, y), whose error is 1.5 times that of a coordinate; then
  // there is z.
  const double slack = 4 * (error * torus_.to_frame.scale + torus_.to_frame.error) + 0x1p-46 * far;
  const double minor = torus_.family.minor();
  const auto distance = [](double rho, double z) { return std::sqrt((rho - 1) * (rho - 1) + z * z); };
  if (std::all_of(at.begin(), at.end(), [&](const Place& p) {
        return distance(p.least, p.z) + slack <= minor && distance(p.most, p.z) + slack <= minor;
      }))
    return Label::in;
  const auto is_beyond = [&](const std::array<double, 2>& e) {
    return std::all_of(at.begin(), at.end(), [&](const Place& p) {
      return e[0] * ((e[0] >= 0 ? p.least : p.most) - 1) + e[1] * p.z > minor + slack;
    });
  };
  for (const Place& p : at) {
    const double rho = (p.least + p.most) / 2;
    if (is_beyond(torus_.family.middle(wedge.level, torus_.family.arc_towards(wedge.level, rho, p.z))))
      return Label::out;
    const double length = distance(rho, p.z);
    if (length > 0 && is_beyond({(rho - 1) / length, p.z / length})) return Label::out;
  }
  return Label::fuzzy;
}

// --- advice ---

Advice TorusProducer::advise(const Word* leaf, CellView<3>& cell) const {
  const State state = state_of(leaf);
  const auto crosses = [&](OrientedHyperplane plane) { return cell.crosses(plane.id()); };
  if (!state.known) {
    const Wedge wedge = quarter(cell);
    for (const int side : {1, -1}) {
      const OrientedHyperplane radial = torus_.radial(torus_.fan.bound(wedge, 0, side));
      if (crosses(radial)) return {radial};
    }
  } else {
    if (state.wedge.level > 0) {
      // What is farthest out first; then the middle of the cell.
      double furthest = -1, rho = 0, z = 0, middle_rho = 0, middle_z = 0;
      const auto at = places(state.wedge, cell);
      for (const Place& place : at) {
        const double mean = (place.least + place.most) / 2,
                     distance = std::sqrt((mean - 1) * (mean - 1) + place.z * place.z);
        middle_rho += mean / static_cast<double>(at.size());
        middle_z += place.z / static_cast<double>(at.size());
        if (distance <= furthest) continue;
        furthest = distance;
        rho = mean;
        z = place.z;
      }
      for (const auto& [x, y] : {std::pair(rho, z), std::pair(middle_rho, middle_z)}) {
        const auto arc = torus_.family.arc_towards(state.wedge.level, x, y);
        const OrientedHyperplane outer = torus_.plane(torus_.family.outer(state.wedge, arc)),
                                 inner = torus_.plane(torus_.family.inner(state.wedge, arc));
        if (crosses(outer))
          return {outer};  // what is beyond is asked again: in a narrower wedge other tangents tell
        if (crosses(inner)) return {inner};
      }
    }
    if (state.wedge.level < torus_.levels()) {
      const OrientedHyperplane radial = torus_.radial(torus_.fan.halving(state.wedge, 0));
      if (crosses(radial)) return {radial};
    }
  }
  for (const int axis : cell.extent().axes_by_length()) {
    const HyperplaneId id = network_.axial_cut(axis, cell.extent().middle[static_cast<std::size_t>(axis)]);
    if (cell.crosses(id)) return {geometry::oriented(id)};
  }
  return {.plane = {}, .none = true};
}

static_assert(ProducerProcess<TorusProducer, 3>);

}  // namespace bsp2::dataflow
