#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// Makes nodes so that equal ones are one node ("hash consing").
///
/// Children are compared by identity: they come from the same pool, so equal ones are the same already. Hence
/// a comparison costs the size of one node, never that of a subtree. Also folds what cannot change the
/// meaning: empty operands, Booleans of one operand. Not thread-safe.
class NodePool {
 public:
  static constexpr int most_dimensions = geometry::most_dimensions;
  /// The empty solid of this dimension; of dimension 0: not even that ("nothing"), which has no say in
  /// anything.
  [[nodiscard]] const Expression& empty(int dimension) const {
    return empty_[static_cast<std::size_t>(dimension)];
  }
  [[nodiscard]] bool is_empty(const Expression& e) const { return e.same_node(empty(e.dimension())); }
  Expression primitive(Primitive primitive, int dimension);
  /// A Boolean of operands that are empty or of this dimension. None at all is the empty solid.
  /// @param one_part: it is what a single primitive of the source is made of.
  Expression boolean(Operation operation, int dimension, std::span<const Expression> operands,
                     bool one_part = false);
  /// `matrix` is affine and not singular.
  Expression transform(std::vector<double> matrix, const Expression& child);
  Expression coloured(const Colour& colour, const Expression& child);
  Expression named(Named::Role role, const std::string& name, const Expression& child);
  /// The pooled version of what the builder made of primitives, maps and Booleans.
  Expression adopt(const Expression& made);
  /// @pre no operand is empty.
  Expression construction(const Construct& construct, int dimension, std::span<const Expression> operands);

 private:
  template <class Equal, class Make>
  Expression find_or_make(std::uint64_t hash, int dimension, Equal equal, Make make);
  void grow();

  struct Slot {
    std::uint64_t hash = 0;
    std::uint32_t index = 0;  ///< 1 + index in nodes_, 0 = free
  };
  std::array<Expression, most_dimensions + 1> empty_{Expression(0), Expression(1), Expression(2),
                                                     Expression(3), Expression(4), Expression(5),
                                                     Expression(6)};
  std::vector<Slot> slots_ = std::vector<Slot>(64);
  std::vector<Expression> nodes_;
  std::vector<Expression> operands_;  // scratch
};

}  // namespace bsp2::model
