#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a round solid: refined without end, level by level, by chords and tangents.
///
/// IN and OUT are certain: they come from exact predicates, or from bounds of a cell's vertices that allow
/// for all rounding. State of a leaf: the wedge of the solid's directions that the cell is in, if it is known
/// (see RoundFamily), then the half-spaces of the box that cross the cell. Source: the paper, section 4.1 and
/// figure 5; docs/curved.md.
///
/// A placed solid (round_solid.hpp) is asked, besides what all round solids are, for
///   Wedge         a part of the space around it: a number of coordinates `at` on a grid of 2^level, and a
///   face levels()      to which wedges are divided; places(): how many coordinates they have first_wedge of
///   a point of the frame, and outer(i), i < outer_count(): hyperplanes that have all of the
///                 solid on their negative side, for cells of which no wedge is known
///   halving, bound   hyperplanes that halve a wedge along a coordinate, and that bound it
///   tangent          of a wedge: has all of the solid on its negative side
///   chord            of a wedge: what is on its negative side within the wedge is solid
///   ask_vertices     IN or OUT if the vertices of a cell tell, by its wedge if that is known
template <int D, typename Solid>
class RoundProducer {
 public:
  RoundProducer(const Network<D>& network, const Producer<D>& producer, const Solid& solid)
      : network_(network), producer_(producer), round_(solid) {}

  geometry::Label ask(const Word* leaf, CellView<D>& cell, Words& out) const;
  /// Grows with the level: what is refined already can wait for what is not.
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  /// Whether any of its flat faces is undecided.
  [[nodiscard]] bool has_planes(const Word* leaf) const { return undecided_planes(leaf) != 0; }
  /// Whether the round surface need not be near all of the cell: where no wedge is known, or one of which
  /// tangent and chord are farther apart than `tolerance`, or the cell reaches so far beyond them.
  [[nodiscard]] bool is_coarse(const Word* leaf, const CellView<D>& cell, double tolerance) const;
  /// A hyperplane of the box, the wedge's tangent or chord, or what halves the wedge; at the last level,
  /// across the longest axis of the cell. No advice where the cell is too small for that.
  Advice advise(const Word* leaf, CellView<D>& cell) const;

 private:
  using Wedge = typename Solid::Wedge;
  /// What is known about the round part of the solid within a cell.
  struct State {
    enum class Kind : Word { anywhere, wedge, inside } kind = Kind::anywhere;
    Wedge wedge;
  };
  static constexpr std::size_t at_kind = Program::header, at_face = at_kind + 1, at_level = at_face + 1,
                               at_place = at_level + 1;

  const Network<D>& network_;
  const Producer<D>& producer_;
  const Solid& round_;

  [[nodiscard]] std::size_t header() const { return at_place + static_cast<std::size_t>(round_.places()); }
  [[nodiscard]] std::size_t undecided_planes(const Word* leaf) const {
    return (leaf[0] & Program::whole) != 0 ? producer_.plane_count : leaf[1] - header();
  }
  [[nodiscard]] State state_of(const Word* leaf) const;
  void put(const State& state, Words& out) const;
  [[nodiscard]] std::span<const geometry::OrientedHyperplane> planes_of(const Word* leaf) const;
  geometry::Label ask_round(State& state, CellView<D>& cell) const;
  void tighten(State& state, CellView<D>& cell) const;
  [[nodiscard]] Wedge first_wedge(const CellView<D>& cell) const {
    return round_.first_wedge(round_.to_frame.image(cell.extent().centre));
  }
  [[nodiscard]] bool is_within(const Wedge& wedge, CellView<D>& cell) const;
  Advice advise_round(const State& state, CellView<D>& cell, bool alone) const;
};

// --- the state of a leaf ---

template <int D, typename Solid>
typename RoundProducer<D, Solid>::State RoundProducer<D, Solid>::state_of(const Word* leaf) const {
  State state;
  if ((leaf[0] & Program::whole) != 0) return state;
  state.kind = static_cast<typename State::Kind>(leaf[at_kind]);
  state.wedge.face = leaf[at_face];
  state.wedge.level = leaf[at_level];
  std::copy_n(leaf + at_place, round_.places(), state.wedge.at.begin());
  return state;
}

template <int D, typename Solid>
void RoundProducer<D, Solid>::put(const State& state, Words& out) const {
  out.push(static_cast<Word>(state.kind), state.wedge.face, state.wedge.level);
  out.append(std::span(state.wedge.at).first(static_cast<std::size_t>(round_.places())));
}

template <int D, typename Solid>
std::span<const geometry::OrientedHyperplane> RoundProducer<D, Solid>::planes_of(const Word* leaf) const {
  static_assert(sizeof(geometry::OrientedHyperplane) == sizeof(Word));
  if ((leaf[0] & Program::whole) != 0) return network_.planes_of(producer_);
  return {reinterpret_cast<const geometry::OrientedHyperplane*>(leaf + header()), leaf[1] - header()};
}

template <int D, typename Solid>
std::size_t RoundProducer<D, Solid>::undecided(const Word* leaf) const {
  const State state = state_of(leaf);
  return undecided_planes(leaf) +
         (state.kind == State::Kind::inside ? 0 : 1 + 2 * std::size_t{state.wedge.level});
}

// --- asking ---

template <int D, typename Solid>
geometry::Label RoundProducer<D, Solid>::ask(const Word* leaf, CellView<D>& cell, Words& out) const {
  State state = state_of(leaf);
  out.push(leaf[0] & ~Program::whole, 0, leaf[2]);
  const std::size_t begin = out.size();
  put(state, out);
  const std::size_t first_plane = out.size();
  for (const geometry::OrientedHyperplane plane : planes_of(leaf)) {
    const geometry::Position where = cell.position(plane);
    if (where == geometry::Position::positive) return geometry::Label::out;
    if (where == geometry::Position::crossing) out.push(plane.code);
  }
  if (cell.box_test_only()) return geometry::Label::fuzzy;
  const geometry::Label label =
      state.kind == State::Kind::inside ? geometry::Label::in : ask_round(state, cell);
  if (label == geometry::Label::out || (label == geometry::Label::in && out.size() == first_plane))
    return label;
  if (label == geometry::Label::in) state.kind = State::Kind::inside;
  Words words;
  put(state, words);
  std::copy(words.begin(), words.end(), out.begin() + begin);
  return geometry::Label::fuzzy;
}

/// Where the cell is with respect to the round part alone.
template <int D, typename Solid>
geometry::Label RoundProducer<D, Solid>::ask_round(State& state, CellView<D>& cell) const {
  const Wedge* known = state.kind == State::Kind::wedge ? &state.wedge : nullptr;
  if (const geometry::Label label = round_.ask_vertices(known, cell.cell(), cell.extent().centre);
      label != geometry::Label::fuzzy)
    return label;
  tighten(state, cell);
  if (state.kind != State::Kind::wedge) {
    for (std::uint32_t i = 0; i < round_.outer_count(); ++i)
      if (cell.position(round_.outer(i)) == geometry::Position::positive) return geometry::Label::out;
    return geometry::Label::fuzzy;
  }
  if (cell.position(round_.tangent(state.wedge)) == geometry::Position::positive) return geometry::Label::out;
  return cell.position(round_.chord(state.wedge)) == geometry::Position::negative ? geometry::Label::in
                                                                                  : geometry::Label::fuzzy;
}

template <int D, typename Solid>
bool RoundProducer<D, Solid>::is_within(const Wedge& wedge, CellView<D>& cell) const {
  for (int j = 0; j < round_.places(); ++j)
    if (cell.position(round_.bound(wedge, j, 1)) != geometry::Position::negative ||
        cell.position(round_.bound(wedge, j, -1)) != geometry::Position::positive)
      return false;
  return true;
}

/// Finds the smallest wedge that the cell is known to be in.
template <int D, typename Solid>
void RoundProducer<D, Solid>::tighten(State& state, CellView<D>& cell) const {
  if (state.kind == State::Kind::anywhere) {
    const Wedge wedge = first_wedge(cell);
    if (!is_within(wedge, cell)) return;
    state = {State::Kind::wedge, wedge};
  }
  while (state.wedge.level < round_.levels()) {
    Wedge half = state.wedge;
    ++half.level;
    for (int j = 0; j < round_.places(); ++j) {
      const geometry::Position where = cell.position(round_.halving(state.wedge, j));
      if (where == geometry::Position::crossing) return;
      auto& at = half.at[static_cast<std::size_t>(j)];
      at = 2 * at + (where == geometry::Position::positive ? 1 : 0);
    }
    state.wedge = half;
  }
}

template <int D, typename Solid>
bool RoundProducer<D, Solid>::is_coarse(const Word* leaf, const CellView<D>& cell, double tolerance) const {
  const State state = state_of(leaf);
  if (state.kind != State::Kind::wedge) return true;
  const auto beyond = [&](geometry::OrientedHyperplane plane, const std::array<double, D>& point) {
    const auto h = cell.table().rounded(plane.id());
    double square = 0;
    for (const double c : h.normal) square += c * c;
    return (plane.flipped() ? -h.at(point) : h.at(point)) / std::sqrt(square);
  };
  const geometry::OrientedHyperplane tangent = round_.tangent(state.wedge), chord = round_.chord(state.wedge);
  const auto& centre = cell.extent().centre;
  if (beyond(chord, centre) - beyond(tangent, centre) > tolerance) return true;
  const auto vertices = cell.cell().vertices();
  return std::any_of(vertices.begin(), vertices.end(), [&](const auto& vertex) {
    return beyond(tangent, vertex.x) > tolerance || beyond(chord, vertex.x) < -tolerance;
  });
}

// --- advice ---

template <int D, typename Solid>
Advice RoundProducer<D, Solid>::advise(const Word* leaf, CellView<D>& cell) const {
  const State state = state_of(leaf);
  const auto planes = planes_of(leaf);
  if (planes.empty()) return advise_round(state, cell, true);
  Advice advice;
  double furthest = -std::numeric_limits<double>::infinity();
  for (const geometry::OrientedHyperplane plane : planes) {
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
template <int D, typename Solid>
Advice RoundProducer<D, Solid>::advise_round(const State& state, CellView<D>& cell, bool alone) const {
  const auto crossing = [&](geometry::OrientedHyperplane plane) { return cell.crosses(plane.id()); };
  const bool known = state.kind == State::Kind::wedge;
  const Wedge wedge = known ? state.wedge : first_wedge(cell);
  const geometry::OrientedHyperplane tangent = round_.tangent(wedge), chord = round_.chord(wedge);
  if (crossing(tangent)) return {tangent, true};
  if (crossing(chord)) return {chord, false, known && alone};
  if (!known || wedge.level < round_.levels())
    for (int j = 0; j < round_.places(); ++j)
      for (const int side : {1, -1}) {
        const geometry::OrientedHyperplane radial =
            known ? round_.halving(wedge, j) : round_.bound(wedge, j, side);
        if (crossing(radial)) return {radial};
      }
  for (const int axis : cell.extent().axes_by_length()) {
    const geometry::HyperplaneId id = network_.axial_cut(axis, cell.extent().middle[axis]);
    if (cell.crosses(id)) return {geometry::oriented(id)};
  }
  return {.plane = {}, .none = true};
}

}  // namespace bsp2::dataflow
