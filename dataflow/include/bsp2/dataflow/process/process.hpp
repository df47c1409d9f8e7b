#pragma once

#include <concepts>
#include <vector>

#include "bsp2/dataflow/process/cell_view.hpp"
#include "bsp2/dataflow/process/program.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

/// The processes of the dataflow network, after section 4.1 of the paper. Each maps a stream of refinements
/// to a stream of refinements: a cell that was undecided is replaced by what it turned out to be (IN or OUT),
/// or by the two halves of a split.
///
///   Producer     no input: ConvexProducer, LatheProducer, MeshProducer, RoundProducer, TorusProducer,
///                SplineProducer, PreimageProducer. Asked about a cell, it says
///                IN, OUT, or which hyperplane would help.
///   Transformer  one input: Transformer maps the hyperplanes of a producer, Complement exchanges IN and OUT.
///   Combiner     several inputs: Combiner folds the answers of its operands into one.
///   Consumer     no output: Consumer gets the decided cells.
///
/// A token is a cell with the producers and combiners that are undecided about it, so firing a token
/// (Localizer) runs it through all processes at once. Which process is meant is known at compile time: no
/// virtual call a cell.
namespace bsp2::dataflow {

/// No producer: see Answer::owner.
inline constexpr std::int32_t no_owner = -1;

/// What a process says about a cell: its label, and for IN the producer that the cell belongs to: one that is
/// an operand, and IN, on all of it.
struct Answer {
  geometry::Label label;
  std::int32_t owner = no_owner;
  friend bool operator==(const Answer&, const Answer&) = default;
};

/// The hyperplane along which an undecided producer would like the cell to be cut; it crosses the cell.
struct Advice {
  geometry::OrientedHyperplane plane;
  bool beyond_is_out = false;  ///< the positive side is outside of the producer
  bool behind_is_in = false;   ///< the negative side is inside of it
  bool none = false;           ///< no hyperplane helps: the cell is too small
};

/// A producer as the network drives it, one cell at a time. What it still does not know about a cell is its
/// *state*, the words of a leaf of the program; the state for a half of the cell follows from the state for
/// the cell.
template <typename P, int D>
concept ProducerProcess = requires(const P& producer, const Word* leaf, CellView<D>& cell, Words& out) {
  /// The label within the cell; for FUZZY the leaf with its new state is appended to `out`, all but its
  /// length.
  { producer.ask(leaf, cell, out) } -> std::same_as<geometry::Label>;
  /// How many half-spaces or facets are undecided: an estimate of the work that is left.
  { producer.undecided(leaf) } -> std::same_as<std::size_t>;
  /// After an answer FUZZY, which came from exact predicates. The leaf is what `ask` appended for this cell.
  { producer.advise(leaf, cell) } -> std::same_as<Advice>;
};

}  // namespace bsp2::dataflow
