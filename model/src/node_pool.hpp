#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/model/expression.hpp"

namespace bsp2::model {

/// Makes nodes so that equal ones are one node ("hash consing").
///
/// Children are compared by identity: they come from the same pool, so equal ones are the same already. Hence
/// a comparison costs the size of one node, never that of a subtree. Also folds what cannot change the
/// meaning: empty operands, Booleans of one operand. Not thread-safe.
class NodePool {
 public:
  explicit NodePool(int dimension = 3) : empty_(dimension) {}

  [[nodiscard]] const Expression& empty() const { return empty_; }
  Expression primitive(Primitive primitive);
  /// Unite, intersect or subtract, of any number of operands. None at all is the empty solid.
  Expression boolean(Operation operation, std::span<const Expression> operands);
  /// `matrix` is affine and not singular.
  Expression transform(std::span<const double> matrix, const Expression& child);

 private:
  template <class Equal, class Make>
  Expression find_or_make(std::uint64_t hash, Equal equal, Make make);
  void grow();
  [[nodiscard]] bool is_empty(const Expression& e) const { return e.same_node(empty_); }

  struct Slot {
    std::uint64_t hash = 0;
    std::uint32_t index = 0;  ///< 1 + index in nodes_, 0 = free
  };
  Expression empty_;
  std::vector<Slot> slots_ = std::vector<Slot>(64);
  std::vector<Expression> nodes_;
  std::vector<Expression> operands_;  // scratch
};

}  // namespace bsp2::model
