#include "producers/convex_producer.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

template <int D>
Label ConvexProducer<D>::ask(const Word* leaf, CellView<D>& cell, Words& out) const {
  const bool whole = (leaf[0] & Program::whole) != 0;
  if (cell.box_test_only() && whole && cell.extent().contains(producer_)) {
    out.append({leaf, Program::header});
    return Label::fuzzy;
  }
  out.push(leaf[0] & ~Program::whole, 0, leaf[2]);
  const std::size_t begin = out.size();
  const auto planes = undecided_planes(leaf);
  if (!whole) {  // exactly at once: what crossed the cell that this one was cut from crosses it most often,
                 // too, so a box would not tell
    if (!cell.find_crossing(planes, out)) return Label::out;
    return out.size() == begin ? Label::in : Label::fuzzy;
  }
  for (const OrientedHyperplane plane : planes) {
    const Position where = cell.position(plane);
    if (where == Position::positive) return Label::out;
    if (where == Position::crossing) out.push(plane.code);
  }
  return out.size() == begin ? Label::in : Label::fuzzy;
}

namespace {

/// One of many, with no regard to their order, and always the same one of the same number.
OrientedHyperplane any_of(std::span<const OrientedHyperplane> planes) {
  constexpr std::uint64_t golden_ratio = 0x9e3779b97f4a7c15;
  return planes[(golden_ratio * planes.size() >> 32) % planes.size()];
}

}  // namespace

template <int D>
Advice ConvexProducer<D>::advise(const Word* leaf, CellView<D>& cell) const {
  const auto planes = undecided_planes(leaf);
  // The attempt costs more than a cut; where it fails, all planes may meet in an apex, and it is not repeated
  // at once.
  if (planes.size() > many_planes && planes.size() % 32 == 0)
    if (const auto half = halve(leaf, cell)) return {geometry::oriented(*half)};
  // In the plane nearly all lines of a long arc cross both halves of a box, and until a few that are spread
  // over it have been cut along no half has less of them.
  if (D == 2 && planes.size() > many_planes) return {any_of(planes), true};
  OrientedHyperplane chosen;
  double furthest = -std::numeric_limits<double>::infinity();
  for (const OrientedHyperplane plane : planes) {
    const auto h = cell.table().rounded(plane.id());
    const double value = plane.flipped() ? -h.at(cell.extent().centre) : h.at(cell.extent().centre);
    if (value > furthest) {
      furthest = value;
      chosen = plane;
    }
  }
  return {chosen, true, planes.size() == 1};
}

template <int D>
std::span<const OrientedHyperplane> ConvexProducer<D>::undecided_planes(const Word* leaf) const {
  static_assert(sizeof(OrientedHyperplane) == sizeof(Word));
  if ((leaf[0] & Program::whole) != 0) return network_.planes_of(producer_);
  return {reinterpret_cast<const OrientedHyperplane*>(leaf + Program::header), leaf[1] - Program::header};
}

/// An axis-parallel cut that parts very many half-spaces: cutting along one after the other would take time
/// quadratic in their number.
template <int D>
std::optional<HyperplaneId> ConvexProducer<D>::halve(const Word* leaf, CellView<D>& cell) const {
  const auto planes = undecided_planes(leaf);
  const auto& table = cell.table();
  geometry::Splitter<D>& splitter = cell.splitter();
  geometry::VertexColumns<D> columns;
  std::size_t fewest = planes.size() * 17 / 20;  // more than that in one half is no progress
  std::optional<HyperplaneId> best;
  for (int axis = 0; axis < D; ++axis) {
    const HyperplaneId id = network_.axial_cut(axis, cell.extent().centre[axis]);
    if (splitter.classify(cell.cell(), id) != Position::crossing) continue;
    std::array<geometry::Cell<D>, 2> halves;
    splitter.split(cell.cell(), id, &halves[0], &halves[1]);
    std::size_t most = 0;
    for (const geometry::Cell<D>& half : halves) {
      columns.load(half);
      most = std::max<std::size_t>(
          most,
          static_cast<std::size_t>(std::count_if(planes.begin(), planes.end(), [&](OrientedHyperplane plane) {
            return splitter.position(half, columns, plane.id(), table.rounded(plane.id())) ==
                   Position::crossing;
          })));
      if (most >= fewest) break;
    }
    if (most >= fewest) continue;
    fewest = most;
    best = id;
  }
  return best;
}

#define BSP2_INSTANTIATE(D)         \
  template class ConvexProducer<D>; \
  static_assert(ProducerProcess<ConvexProducer<D>, D>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
