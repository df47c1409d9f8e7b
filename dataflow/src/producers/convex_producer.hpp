#pragma once

#include <optional>
#include <span>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a convex polytope: OUT outside one of its half-spaces, IN inside all of them, otherwise left
/// with the half-spaces whose hyperplanes cross the cell.
///
/// State of a leaf: the codes of these hyperplanes, inside negative.
template <int D>
class ConvexProducer {
 public:
  ConvexProducer(const Network<D>& network, const Producer<D>& producer)
      : network_(network), producer_(producer) {}

  geometry::Label ask(const Word* leaf, CellView<D>& cell, Words& out) const;
  [[nodiscard]] std::size_t undecided(const Word* leaf) const {
    return (leaf[0] & Program::whole) != 0 ? producer_.plane_count : leaf[1] - Program::header;
  }
  /// The half-space that leaves most of the cell outside; of very many, a cut that parts them if there is
  /// one.
  Advice advise(const Word* leaf, CellView<D>& cell) const;
  [[nodiscard]] std::span<const geometry::OrientedHyperplane> undecided_planes(const Word* leaf) const;

  /// With more undecided half-spaces, the cell is halved first.
  static constexpr std::size_t many_planes = 160;

 private:
  const Network<D>& network_;
  const Producer<D>& producer_;
  std::optional<geometry::HyperplaneId> halve(const Word* leaf, CellView<D>& cell) const;
};

}  // namespace bsp2::dataflow
