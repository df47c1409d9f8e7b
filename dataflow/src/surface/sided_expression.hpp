#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/dataflow/process/program.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "process/transformer.hpp"

namespace bsp2::dataflow {

/// What an expression is on the two sides of a piece of surface, as far as is known of its operands: IN, OUT,
/// or FUZZY. What one operand turns out to be changes its combiners alone. Thread rule: one thread at a time.
class SidedExpression {
 public:
  using Label = geometry::Label;
  enum Side : std::uint8_t { below, above };

  /// All operands are FUZZY. Linear in the program, which is not needed afterwards.
  void load(std::span<const Word> program) {
    nodes_.clear();
    leaves_.clear();
    const Word* at = program.data();
    load(at, no_parent);
  }
  [[nodiscard]] std::size_t operands() const { return leaves_.size(); }
  /// @param operand counted through the leaves of the program.
  void set(std::size_t operand, Label below_label, Label above_label) {
    set(operand, below, below_label);
    set(operand, above, above_label);
  }
  [[nodiscard]] Label label(Side side) const { return root_[side]; }
  /// Whether what an operand is may still change the answer on some side.
  [[nodiscard]] bool matters(std::size_t operand) const {
    for (const Side side : {below, above}) {
      std::uint32_t at = leaves_[operand].parent;
      while (at != no_parent && nodes_[at].sides[side].label == Label::fuzzy) at = nodes_[at].parent;
      if (at == no_parent) return true;
    }
    return false;
  }

 private:
  static constexpr std::uint32_t no_parent = ~0U;
  struct Counts {
    std::uint32_t fuzzy = 0,
                  counted = 0;  ///< operands; those of the deciding label, of a difference those IN
    Label label = Label::fuzzy;
  };
  struct Node {
    std::uint32_t parent;
    Word kind, memory;
    std::array<Counts, 2> sides;
  };
  struct Leaf {
    std::uint32_t parent;
    bool negated;
    std::array<Label, 2> labels{Label::fuzzy, Label::fuzzy};
  };
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::array<Label, 2> root_{};

  void load(const Word*& at, std::uint32_t parent) {
    const Word kind = at[0] & Program::kind_mask;
    const Word* const begin = at;
    const Word* const end = at + at[1];
    if (parent != no_parent)
      for (Counts& counts : nodes_[parent].sides) ++counts.fuzzy;
    else
      root_.fill(Label::fuzzy);
    if (kind == Program::kind_leaf) {
      at = end;
      leaves_.push_back({parent, (begin[0] & Program::negated) != 0});
      return;
    }
    const auto own = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({parent, kind, begin[2], {}});
    at += Program::header;
    while (at != end) load(at, own);
  }

  static bool is_counted(Word kind, Label label) {
    return label == (kind == Program::kind_intersect ? Label::out : Label::in);
  }
  static Label label_of(const Node& node, const Counts& counts) {
    if (node.kind == Program::kind_differ)
      return counts.fuzzy > 0                              ? Label::fuzzy
             : (((node.memory ^ counts.counted) & 1) != 0) ? Label::in
                                                           : Label::out;
    const bool unites = node.kind == Program::kind_unite;
    if (counts.counted > 0) return unites ? Label::in : Label::out;
    return counts.fuzzy > 0 ? Label::fuzzy : unites ? Label::out : Label::in;
  }

  void set(std::size_t operand, Side side, Label label) {
    Leaf& leaf = leaves_[operand];
    if (leaf.negated) label = Complement::map(label);
    Label old = std::exchange(leaf.labels[side], label);
    std::uint32_t at = leaf.parent;
    while (old != label) {
      if (at == no_parent) {
        root_[side] = label;
        return;
      }
      Node& node = nodes_[at];
      Counts& counts = node.sides[side];
      if (old == Label::fuzzy) --counts.fuzzy;
      if (old != Label::fuzzy && is_counted(node.kind, old)) --counts.counted;
      if (label == Label::fuzzy) ++counts.fuzzy;
      if (label != Label::fuzzy && is_counted(node.kind, label)) ++counts.counted;
      old = counts.label;
      label = counts.label = label_of(node, counts);
      at = node.parent;
    }
  }
};

}  // namespace bsp2::dataflow
