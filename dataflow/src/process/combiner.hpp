#pragma once

#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// An n-ary Boolean: a process with several input streams, the answers of its operands, and one output
/// stream.
///
/// Operands answer one after the other, and not all at once: those that did are *folded* away and need not be
/// asked again within the cell; the combiner only remembers (in one word) what they leave behind. Symmetric
/// differences count modulo 2. The owner of an IN answer is the lowest one among the IN operands, which is
/// that of the first operand that names any; a union takes the one that decided it. Source: the paper,
/// section 4.1, "Combiners".
class Combiner {
 public:
  /// @param kind Program::kind_unite, kind_intersect or kind_differ. @param memory what `memory` returned for
  /// this cell or one that it is part of; 0 at first.
  Combiner(Word kind, Word memory) : kind_(kind), memory_(memory) {}

  /// The label of an operand that decides the result alone. Not for symmetric differences, which no operand
  /// decides.
  [[nodiscard]] static geometry::Label deciding(Word kind) {
    return kind == Program::kind_unite ? geometry::Label::in : geometry::Label::out;
  }

  /// Folds an operand's answer, IN or OUT. @return whether it decides the result, which then is this very
  /// answer.
  bool fold(const Answer& operand) {
    const bool in = operand.label == geometry::Label::in;
    if (kind_ != Program::kind_differ && operand.label == deciding(kind_)) return true;
    if (!in) return false;
    const auto owner = static_cast<Word>(operand.owner + 1);  // 0: none
    if (kind_ == Program::kind_intersect) {
      memory_ = lower(memory_, owner);
    } else {
      memory_ = lower(memory_ >> 1, owner) << 1 | ((memory_ & 1) ^ 1);
    }
    return false;
  }

  /// The answer once all operands are folded and none has decided it.
  [[nodiscard]] Answer answer() const {
    using geometry::Label;
    if (kind_ == Program::kind_unite) return {Label::out};
    if (kind_ == Program::kind_intersect) return {Label::in, static_cast<std::int32_t>(memory_) - 1};
    return (memory_ & 1) != 0 ? Answer{Label::in, static_cast<std::int32_t>(memory_ >> 1) - 1}
                              : Answer{Label::out};
  }

  /// What is to be remembered of the operands that were folded: their lowest owner (plus one, 0: none), for
  /// symmetric differences times two plus the parity of the IN ones.
  [[nodiscard]] Word memory() const { return memory_; }
  /// Whether a single operand that is left answers for the combiner.
  [[nodiscard]] bool is_transparent() const { return memory_ == 0; }

 private:
  Word kind_, memory_;
  static Word lower(Word known, Word owner) {
    return owner != 0 && (known == 0 || owner < known) ? owner : known;
  }
};

}  // namespace bsp2::dataflow
