#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/dataflow/network.hpp"
#include "bsp2/geometry/cell.hpp"
#include "bsp2/geometry/cell_batch.hpp"
#include "bsp2/geometry/splitter.hpp"

namespace bsp2::dataflow {

/// What a process knows about a cell: its label, and for IN a primitive that contains it.
struct Answer {
  geometry::Label label;
  std::int32_t part = geometry::no_part;
};

/// A box and a ball around a cell, slightly enlarged: quick, conservative tests before the exact ones.
template <int D>
struct CellExtent {
  std::array<double, D> lower, upper;
  std::array<double, D> middle, half;  ///< the box's centre and half its size
  std::array<double, D> centre;        ///< mean of the vertices, inside the cell
  double radius;
  explicit CellExtent(const geometry::Cell<D>& cell);
  [[nodiscard]] bool misses(const std::array<double, D>& low, const std::array<double, D>& high) const;
  [[nodiscard]] bool contains(const std::array<double, D>& low, const std::array<double, D>& high) const;
  /// Where the cell lies, `crossing` also where the box alone cannot tell.
  [[nodiscard]] geometry::Position position(const geometry::Hyperplane<D>& h) const;
};

/// Fires a token through the network: asks the producers of its localized expression about a cell, folds answered
/// operands away, and says which hyperplane would help most with what is left.
///
/// Thread rule: one thread at a time; the network is shared and only read.
/// Source: the paper, section 3; design of n-ary localized combiners.
template <int D>
class Localizer {
 public:
  Localizer(const Network<D>& network, geometry::Splitter<D>& splitter) : network_(&network), splitter_(&splitter) {}

  /// A hyperplane that crosses the cell, and what is known about its halves beforehand.
  struct Cut {
    geometry::HyperplaneId hyperplane = 0;
    bool negative_is_out = false, positive_is_out = false;  ///< that half need not be built
  };
  /// The expression `program` within `cell`: IN, OUT, or FUZZY with the simplified expression in `out` and the hyperplane
  /// to split by in `cut`. The result depends on the arguments alone.
  Answer fire(std::span<const Word> program, const geometry::Cell<D>& cell, std::vector<Word>& out, Cut& cut);

  /// An operand that is left, and how many of its half-spaces or facets are undecided.
  struct UndecidedOperand {
    Word producer;
    std::size_t weight;
  };
  /// Of the program that `fire` put out last, with a FUZZY answer.
  [[nodiscard]] std::vector<UndecidedOperand> undecided_operands(std::span<const Word> program) const;

  /// Whether the whole cell is inside this convex producer. Exact; false for meshes.
  bool contains(const Producer<D>& producer, const geometry::Cell<D>& cell);

 private:
  using Net = Network<D>;
  const Network<D>* network_;
  geometry::Splitter<D>* splitter_;
  const geometry::Cell<D>* cell_ = nullptr;  // the cell at hand
  const CellExtent<D>* extent_ = nullptr;
  geometry::VertexColumns<D> columns_;  // of the cell at hand
  bool quick_ = false;                 // keep what only a look at all vertices could decide
  std::vector<std::uint32_t> active_;  // where the undecided leaves start in the simplified program
  std::vector<Word> second_pass_;
  std::vector<std::pair<double, geometry::HyperplaneId>> candidates_;
  std::vector<std::uint32_t> mesh_planes_;

  Answer localize(std::span<const Word> program, std::vector<Word>& out, bool quick);
  Answer visit(const Word*& at, std::vector<Word>& out);
  Answer visit_combiner(const Word*& at, std::vector<Word>& out);
  Answer visit_leaf(const Word*& at, std::vector<Word>& out);
  geometry::Label visit_convex(const Word* leaf, const Producer<D>& producer, std::vector<Word>& out);
  geometry::Label visit_mesh(const Word* leaf, const Producer<D>& producer, std::vector<Word>& out);
  Answer close(std::size_t begin, std::size_t first_active, std::vector<Word>& out);
  geometry::Position position(geometry::OrientedHyperplane plane);
  [[nodiscard]] std::span<const geometry::OrientedHyperplane> undecided_planes(const Word* leaf) const;

  bool choose_median(std::span<const Word> program, Cut& cut);
  bool choose_half(const Word* leaf, Cut& cut);
  bool choose_mesh_median(const Word* leaf, Cut& cut);
  bool take_middle_candidate(Cut& cut);
  void choose_facet(std::span<const Word> program, Cut& cut);
  geometry::HyperplaneId choose_mesh_plane(const Word* leaf);
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  [[nodiscard]] geometry::Label label_if(const Word*& at, const Word* leaf, geometry::Label assumed) const;
};

}  // namespace bsp2::dataflow
