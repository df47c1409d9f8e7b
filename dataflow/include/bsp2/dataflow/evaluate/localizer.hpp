#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/dataflow/evaluate/split_position.hpp"
#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/cell_view.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::meshing {
class SizeField;
}

namespace bsp2::dataflow {

/// Fires a token through the network: asks the producers of its localized expression about a cell, folds
/// answered operands away in the combiners, and says which hyperplane would help most with what is left.
///
/// Thread rule: one thread at a time; the network is shared and only read.
/// Source: the paper, section 3; design of n-ary localized combiners.
template <int D>
class Localizer {
 public:
  Localizer(const Network<D>& network, geometry::Splitter<D>& splitter)
      : network_(&network), view_(splitter) {}

  /// A hyperplane that crosses the cell, and what is known about its halves beforehand.
  struct Cut {
    geometry::HyperplaneId hyperplane = 0;
    bool negative_is_out = false, positive_is_out = false;  ///< that half need not be built
    /// Not empty where all depends on one convex operand: its undecided half-spaces, inside negative. What is
    /// outside of one of them has the answer `beyond`, what is inside of all has the answer `behind`. Part of
    /// the program that was put out.
    std::span<const geometry::OrientedHyperplane> last_planes{};
    Answer beyond{geometry::Label::out}, behind{geometry::Label::out};
    bool none = false;           ///< nothing is to be cut: the cell stays FUZZY
    bool box_test_only = false;  ///< `decide` may know more
  };
  /// The expression `program` within `cell`: IN, OUT, or FUZZY with the simplified expression in `out` and
  /// the hyperplane to split by in `cut`. The result depends on the arguments alone. FUZZY may come from
  /// tests of boxes alone: that the cell is better cut at once, between many operands, than looked at
  /// closely.
  Answer fire(std::span<const Word> program, const geometry::Cell<D>& cell, Words& out, Cut& cut);

  /// Cells thinner than this are not cut along round solids. 0: all are.
  void set_tolerance(double tolerance) { tolerance_ = tolerance; }
  /// And of that the share for the place of the cell's middle. @param shares none, or it outlives this.
  /// @pre D = 3.
  void set_tolerance_shares(const meshing::SizeField* shares) { tolerance_shares_ = shares; }
  /// Nor cells that are thinner than this angle, in radians, wherever in them one looks from the eye. @pre D
  /// coordinates.
  void set_view(std::span<const double> eye, double angle);

  /// The answer for a cell that will not be cut: FUZZY only if some producer really is undecided.
  Answer decide(std::span<const Word> program, const geometry::Cell<D>& cell, Words& out);

  /// The answer that a program gives away, as far as it was localized: IN although it is undecided what the
  /// cell belongs to, then to the first operand that is known to be IN. Else FUZZY.
  [[nodiscard]] static Answer known(std::span<const Word> program);

  /// Whose a cell is that is known to be IN: the owner in the whole network's answer about it.
  std::int32_t owner_of(const geometry::Cell<D>& cell, Words& out);

  /// An operand that is left, and how many of its half-spaces or facets are undecided.
  struct UndecidedOperand {
    Word producer;
    std::size_t weight;
  };
  /// Of the program that was put out last, with a FUZZY answer.
  [[nodiscard]] std::vector<UndecidedOperand> undecided_operands(std::span<const Word> program) const;

  /// Whether the whole cell is certainly inside this convex producer; false for meshes.
  bool contains(const Producer<D>& producer, const geometry::Cell<D>& cell);
  /// Whether a cell that this producer contains is also in the operand of the model that it is a part of:
  /// nothing cuts it away.
  bool is_left(const Producer<D>& producer, const geometry::Cell<D>& cell);

 private:
  const Network<D>* network_;
  CellView<D> view_;  // of the cell at hand
  struct ActiveLeaf {
    std::uint32_t at;         // where it starts in the simplified program
    std::uint32_t undecided;  // how many of its half-spaces or facets are
  };
  geometry::Buffer<ActiveLeaf> active_;  // the undecided leaves, but for those that stay so
  bool stays_undecided_ = false;         // there may be leaves that do
  bool was_box_test_only_ = false;       // some leaves were asked quickly, and may be decided
  bool covers_ = false;  // what was visited last is FUZZY, but IN: only what the cell belongs to is undecided
  Words second_pass_;
  double tolerance_ = 0;
  const meshing::SizeField* tolerance_shares_ = nullptr;
  std::array<double, D> eye_{};
  double angle_ = 0;  // 0: there is no eye
  /// Where an operand ends, for a cut between operands.
  struct Candidate {
    double distance;  // from where the cut would be best
    Word producer;
    std::uint8_t axis, side;
  };
  std::vector<Candidate> candidates_;
  std::vector<Interval> stretches_;  // of the undecided operands along an axis
  std::vector<geometry::OrientedHyperplane>
      shared_;                              // half-spaces of the operand at hand in which others may end, too
  std::vector<std::uint16_t> place_of_;     // of each hyperplane among those, 0 for all others
  std::vector<std::uint32_t> operands_at_;  // each place

  Answer localize(std::span<const Word> program, Words& out, bool box_test_only);
  Answer visit(const Word*& at, Words& out);
  Answer visit_combiner(const Word*& at, Words& out);
  Answer visit_leaf(const Word*& at, Words& out);
  bool keep_earlier(std::size_t begin, std::size_t first_active, const Answer& last, Words& out);
  /// What the points of a cell may belong to.
  struct Owners {
    std::int32_t part = geometry::no_part;
    bool any = false, several = false;  // parts
    bool nobody = false;                // some may belong to nothing
    void add(std::int32_t other);
    void add(const Owners& others);
  };
  Owners owners_of(const Word*& at) const;
  Owners owners_in_intersection(const Word* at, const Word* end, Word memory) const;
  [[nodiscard]] static bool is_owned(const Word* at, const Word* end, Word memory);
  [[nodiscard]] bool belongs_to(const Word* operand, const Answer& last) const;
  static Answer known(const Word*& at);
  /// A few operands of the union at the root of the network's program, one after the other, and a box that
  /// has all of them.
  struct OperandGroup : Box<D> {
    const Word *begin, *end;
  };
  std::vector<OperandGroup> operand_groups_;  // once they are needed
  void group_operands();
  Box<D> box_of(const Word*& at) const;
  template <typename Use>
  auto with_round(const Producer<D>& producer, const Use& use) const;
  template <typename Use>
  auto with_producer(const Word* leaf, const Use& use) const;
  [[nodiscard]] bool is_convex(const Producer<D>& producer) const;
  [[nodiscard]] bool is_curved(const Word* leaf) const;
  [[nodiscard]] double work_left(std::span<const Word> program) const;

  [[nodiscard]] double thin() const;
  [[nodiscard]] bool is_thin() const;
  [[nodiscard]] bool reaches_beyond_surfaces(std::span<const Word> program);
  void leave_round_operands(std::span<const Word> program);
  SplitPosition part_operands(std::span<const Word> program, int axis);
  std::pair<int, SplitPosition> axis_between_operands(std::span<const Word> program);
  bool choose_between_operands(std::span<const Word> program, Cut& cut);
  void add_ends(std::span<const Word> program, int axis, double place);
  [[nodiscard]] geometry::HyperplaneId hyperplane_at(const Candidate& end) const;
  bool take_nearest_candidate(Cut& cut);
  [[nodiscard]] std::span<const geometry::OrientedHyperplane> listed_planes(const Word* leaf) const;
  [[nodiscard]] std::optional<geometry::OrientedHyperplane> shared_plane(std::span<const Word> program,
                                                                         const Word* leaf);
  void count_shared(std::span<const Word> program);
  void choose_operand(std::span<const Word> program, Cut& cut);
  void offer_clipping(std::span<const Word> program, Cut& cut) const;
  Answer answer_if(const Word*& at, const Answer& leaf) const;
  [[nodiscard]] geometry::Label label_if(const Word*& at, const Word* leaf, geometry::Label assumed) const;
};

}  // namespace bsp2::dataflow
