#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a round solid: refined without end, level by level, by chords and tangents.
///
/// IN and OUT are certain: they come from exact predicates, or from bounds of a cell's vertices that allow
/// for all rounding. State of a leaf: the wedge of the solid's directions that the cell is in, if it is known
/// (see RoundFamily), then the half-spaces of the box that cross the cell. Source: the paper, section 4.1 and
/// figure 5; docs/curved.md.
template <int D>
class RoundProducer {
 public:
  RoundProducer(const Network<D>& network, const Producer<D>& producer)
      : network_(network), producer_(producer), round_(network.rounds[producer.index]) {}

  geometry::Label ask(const Word* leaf, CellView<D>& cell, Words& out) const;
  /// Grows with the level: what is refined already can wait for what is not.
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  /// How many half-spaces of the box are undecided.
  [[nodiscard]] std::size_t undecided_planes(const Word* leaf) const {
    return (leaf[0] & Program::whole) != 0 ? producer_.plane_count : leaf[1] - header();
  }
  /// A hyperplane of the box, the wedge's tangent or chord, or what halves the wedge; at the last level,
  /// across the longest axis of the cell. No advice where the cell is too small for that.
  Advice advise(const Word* leaf, CellView<D>& cell) const;

 private:
  using Family = geometry::RoundFamily<D>;
  using Wedge = typename Family::Wedge;
  using Vector = std::array<double, D>;
  /// What is known about the round part of the solid within a cell.
  struct State {
    enum class Kind : Word { anywhere, wedge, inside } kind = Kind::anywhere;
    Wedge wedge;
  };
  static constexpr std::size_t at_kind = Program::header, at_face = at_kind + 1, at_level = at_face + 1,
                               at_place = at_level + 1;

  const Network<D>& network_;
  const Producer<D>& producer_;
  const Round<D>& round_;

  [[nodiscard]] std::size_t header() const {
    return at_place + static_cast<std::size_t>(round_.family.axes() - 1);
  }
  [[nodiscard]] State state_of(const Word* leaf) const;
  void put(const State& state, Words& out) const;
  [[nodiscard]] std::span<const geometry::OrientedHyperplane> planes_of(const Word* leaf) const;
  geometry::Label ask_round(State& state, CellView<D>& cell) const;
  geometry::Label ask_vertices(const State& state, const CellView<D>& cell) const;
  void tighten(State& state, CellView<D>& cell) const;
  [[nodiscard]] Vector in_frame(const Vector& x) const;
  [[nodiscard]] double radius_at(const Vector& y) const;
  [[nodiscard]] Wedge pyramid(const CellView<D>& cell) const;
  [[nodiscard]] bool is_within(const Wedge& wedge, CellView<D>& cell) const;
  Advice advise_round(const State& state, CellView<D>& cell, bool alone) const;
};

}  // namespace bsp2::dataflow
