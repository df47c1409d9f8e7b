#pragma once

#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a torus: refined without end, level by level, by planes that enclose it in the wedges around
/// its axis.
///
/// IN and OUT come from bounds of the cell's vertices that allow for all rounding: in a wedge a torus lies
/// between two convex solids, see TorusFamily. State of a leaf: the wedge that the cell is in, if it is
/// known. Source: the paper, section 4.1; docs/curved.md.
class TorusProducer {
 public:
  TorusProducer(const Network<3>& network, const Producer<3>&, const Torus& torus)
      : network_(network), torus_(torus) {}

  geometry::Label ask(const Word* leaf, CellView<3>& cell, Words& out) const;
  /// Grows with the level: what is refined already can wait for what is not.
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  [[nodiscard]] static bool has_planes(const Word*) { return false; }
  [[nodiscard]] static bool is_coarse(const Word*, const CellView<3>&, double) { return false; }
  /// The plane that cuts off what is farthest out, then the one within it, then what halves the wedge; at the
  /// last level across the longest axis of the cell. No advice where the cell is too small for that.
  Advice advise(const Word* leaf, CellView<3>& cell) const;

 private:
  using Wedge = geometry::RoundFamily<3>::Wedge;
  using Vector = std::array<double, 3>;
  struct State {
    bool known = false;
    Wedge wedge;
  };
  /// A vertex in a wedge: bounds of its distance to the axis, and its height.
  struct Place {
    double least, most, z;
  };
  static constexpr std::size_t at_known = Program::header, at_face = at_known + 1, at_level = at_face + 1,
                               at_place = at_level + 1;
  const Network<3>& network_;
  const Torus& torus_;

  [[nodiscard]] State state_of(const Word* leaf) const;
  [[nodiscard]] Wedge quarter(const CellView<3>& cell) const;
  [[nodiscard]] bool is_within(const Wedge& wedge, CellView<3>& cell) const;
  void tighten(State& state, CellView<3>& cell) const;
  [[nodiscard]] std::vector<Place> places(const Wedge& wedge, const CellView<3>& cell) const;
  [[nodiscard]] geometry::Label ask_vertices(const Wedge& wedge, const CellView<3>& cell) const;
};

}  // namespace bsp2::dataflow
