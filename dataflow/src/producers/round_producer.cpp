#include "producers/round_producer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

// --- the state of a leaf ---

template <int D>
typename RoundProducer<D>::State RoundProducer<D>::state_of(const Word* leaf) const {
  State state;
  if ((leaf[0] & Program::whole) != 0) return state;
  state.kind = static_cast<typename State::Kind>(leaf[at_kind]);
  state.wedge.face = leaf[at_face];
  state.wedge.level = leaf[at_level];
  std::copy_n(leaf + at_place, round_.family.axes() - 1, state.wedge.at.begin());
  return state;
}

template <int D>
void RoundProducer<D>::put(const State& state, Words& out) const {
  out.push(static_cast<Word>(state.kind), state.wedge.face, state.wedge.level);
  out.append(std::span(state.wedge.at).first(static_cast<std::size_t>(round_.family.axes() - 1)));
}

template <int D>
std::span<const OrientedHyperplane> RoundProducer<D>::planes_of(const Word* leaf) const {
  static_assert(sizeof(OrientedHyperplane) == sizeof(Word));
  if ((leaf[0] & Program::whole) != 0) return network_.planes_of(producer_);
  return {reinterpret_cast<const OrientedHyperplane*>(leaf + header()), leaf[1] - header()};
}

template <int D>
std::size_t RoundProducer<D>::undecided(const Word* leaf) const {
  const State state = state_of(leaf);
  return undecided_planes(leaf) +
         (state.kind == State::Kind::inside ? 0 : 1 + 2 * std::size_t{state.wedge.level});
}

// --- asking ---

template <int D>
Label RoundProducer<D>::ask(const Word* leaf, CellView<D>& cell, Words& out) const {
  State state = state_of(leaf);
  out.push(leaf[0] & ~Program::whole, 0, leaf[2]);
  const std::size_t begin = out.size();
  put(state, out);
  const std::size_t first_plane = out.size();
  for (const OrientedHyperplane plane : planes_of(leaf)) {
    const Position where = cell.position(plane);
    if (where == Position::positive) return Label::out;
    if (where == Position::crossing) out.push(plane.code);
  }
  if (cell.box_test_only()) return Label::fuzzy;
  const Label label = state.kind == State::Kind::inside ? Label::in : ask_round(state, cell);
  if (label == Label::out || (label == Label::in && out.size() == first_plane)) return label;
  if (label == Label::in) state.kind = State::Kind::inside;
  Words words;
  put(state, words);
  std::copy(words.begin(), words.end(), out.begin() + begin);
  return Label::fuzzy;
}

/// Where the cell is with respect to the round part alone.
template <int D>
Label RoundProducer<D>::ask_round(State& state, CellView<D>& cell) const {
  if (const Label label = ask_vertices(state, cell); label != Label::fuzzy) return label;
  tighten(state, cell);
  if (state.kind != State::Kind::wedge) {
    for (std::uint32_t face = 0; face < static_cast<std::uint32_t>(2 * round_.family.axes()); ++face)
      if (cell.position(round_.plane(round_.family.tangent({.face = face}))) == Position::positive)
        return Label::out;
    return Label::fuzzy;
  }
  if (cell.position(round_.plane(round_.family.tangent(state.wedge))) == Position::positive)
    return Label::out;
  if (cell.position(round_.plane(round_.family.chord(state.wedge))) == Position::negative) return Label::in;
  return Label::fuzzy;
}

template <int D>
typename RoundProducer<D>::Vector RoundProducer<D>::in_frame(const Vector& x) const {
  return round_.to_frame.image(x);
}

template <int D>
double RoundProducer<D>::radius_at(const Vector& y) const {
  const Family& family = round_.family;
  return family.bottom() == family.top()
             ? 1
             : family.bottom() + (family.top() - family.bottom()) * y[family.axes()];
}

/// The solid is convex: a cell whose vertices are inside is inside. So is what is beyond a tangent outside.
template <int D>
Label RoundProducer<D>::ask_vertices(const State& state, const CellView<D>& cell) const {
  if (!std::isfinite(round_.to_frame.error)) return Label::fuzzy;
  const int axes = round_.family.axes();
  double error = 0;
  for (const auto& vertex : cell.cell().vertices()) error = std::max(error, vertex.error);
  // Of each coordinate in the frame; then of the distance to the axis minus the radius, which is at most 1
  // there.
  error = error * round_.to_frame.scale + round_.to_frame.error;
  const double slack = error * (D + 1) * 1.01;
  Vector towards{};  // a direction out of the solid, towards the cell
  if (state.kind == State::Kind::wedge)
    towards = round_.family.direction(state.wedge);
  else
    towards = in_frame(cell.extent().centre);
  std::fill(towards.begin() + axes, towards.end(), 0.0);
  double length = 0;
  for (const double x : towards) length += x * x;
  length = std::sqrt(length);
  bool inside = true, outside = length > 0;
  for (const auto& vertex : cell.cell().vertices()) {
    const Vector y = in_frame(vertex.x);
    const double radius = radius_at(y);
    double square = 0, along = 0;
    for (int i = 0; i < axes; ++i) {
      square += y[i] * y[i];
      along += y[i] * towards[i];
    }
    // The sums are off by a few roundings of what they hold.
    const double distance = std::sqrt(square),
                 rounding = 0x1p-48 * (1 + distance + std::fabs(y[std::min(axes, D - 1)]));
    inside = inside && distance + slack + rounding <= radius;
    outside = outside && along / length > radius + slack + rounding;
    if (!inside && !outside) return Label::fuzzy;
  }
  return inside ? Label::in : Label::out;
}

/// The pyramid of directions in which the cell's centre is.
template <int D>
typename RoundProducer<D>::Wedge RoundProducer<D>::pyramid(const CellView<D>& cell) const {
  const Vector y = in_frame(cell.extent().centre);
  int axis = 0;
  for (int i = 1; i < round_.family.axes(); ++i)
    if (std::fabs(y[i]) > std::fabs(y[axis])) axis = i;
  Wedge wedge;
  wedge.face = static_cast<std::uint32_t>(2 * axis + (y[axis] < 0 ? 1 : 0));
  return wedge;
}

template <int D>
bool RoundProducer<D>::is_within(const Wedge& wedge, CellView<D>& cell) const {
  for (int j = 0; j + 1 < round_.family.axes(); ++j)
    if (cell.position(round_.plane(round_.family.bound(wedge, j, 1))) != Position::negative ||
        cell.position(round_.plane(round_.family.bound(wedge, j, -1))) != Position::positive)
      return false;
  return true;
}

/// Finds the smallest wedge that the cell is known to be in.
template <int D>
void RoundProducer<D>::tighten(State& state, CellView<D>& cell) const {
  const Family& family = round_.family;
  if (state.kind == State::Kind::anywhere) {
    const Wedge wedge = pyramid(cell);
    if (!is_within(wedge, cell)) return;
    state = {State::Kind::wedge, wedge};
  }
  while (state.wedge.level < family.levels()) {
    Wedge half = state.wedge;
    ++half.level;
    for (int j = 0; j + 1 < family.axes(); ++j) {
      const Position where = cell.position(round_.plane(family.halving(state.wedge, j)));
      if (where == Position::crossing) return;
      auto& at = half.at[static_cast<std::size_t>(j)];
      at = 2 * at + (where == Position::positive ? 1 : 0);
    }
    state.wedge = half;
  }
}

// --- advice ---

template <int D>
Advice RoundProducer<D>::advise(const Word* leaf, CellView<D>& cell) const {
  const State state = state_of(leaf);
  const auto planes = planes_of(leaf);
  if (planes.empty()) return advise_round(state, cell, true);
  Advice advice;
  double furthest = -std::numeric_limits<double>::infinity();
  for (const OrientedHyperplane plane : planes) {
    const auto h = cell.table().rounded(plane.id());
    const double value = plane.flipped() ? -h.at(cell.extent().centre) : h.at(cell.extent().centre);
    if (value > furthest) {
      furthest = value;
      advice.plane = plane;
    }
  }
  advice.beyond_is_out = true;
  advice.behind_is_in = state.kind == State::Kind::inside && planes.size() == 1;
  return advice;
}

/// @param alone whether nothing but the round part is undecided.
template <int D>
Advice RoundProducer<D>::advise_round(const State& state, CellView<D>& cell, bool alone) const {
  const Family& family = round_.family;
  const auto crossing = [&](OrientedHyperplane plane) { return cell.crosses(plane.id()); };
  const bool known = state.kind == State::Kind::wedge;
  const Wedge wedge = known ? state.wedge : pyramid(cell);
  const OrientedHyperplane tangent = round_.plane(family.tangent(wedge)),
                           chord = round_.plane(family.chord(wedge));
  if (crossing(tangent)) return {tangent, true};
  if (crossing(chord)) return {chord, false, known && alone};
  if (!known || wedge.level < family.levels())
    for (int j = 0; j + 1 < family.axes(); ++j)
      for (const int side : {1, -1}) {
        const OrientedHyperplane radial =
            round_.plane(known ? family.halving(wedge, j) : family.bound(wedge, j, side));
        if (crossing(radial)) return {radial};
      }
  for (const int axis : cell.extent().axes_by_length()) {
    const HyperplaneId id = network_.axial_cut(axis, cell.extent().middle[axis]);
    if (cell.crosses(id)) return {geometry::oriented(id)};
  }
  return {.plane = {}, .none = true};
}

#define BSP2_INSTANTIATE(D)        \
  template class RoundProducer<D>; \
  static_assert(ProducerProcess<RoundProducer<D>, D>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
