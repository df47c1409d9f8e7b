#pragma once

#include <cstddef>
#include <cstdint>

#include "bsp2/geometry/support/buffer.hpp"

namespace bsp2::dataflow {

/// One word of a program.
using Word = std::uint32_t;
/// A program, or a part of one, that is being written.
using Words = geometry::Buffer<Word>;

/// How a localized expression is written down: a tree in prefix order,
///   leaf      kind_leaf | flags, length, producer, state words
///   combiner  kind (unite, intersect, differ), length, memory, operands
/// length counts all words of the subtree; the state of a leaf is its producer's own business (see the
/// producers), the memory of a combiner what it remembers of operands that were folded away (see Combiner).
/// Where the model has several parts (Network::is_divided), a union may end in a `known` leaf: it is IN, but
/// earlier operands, which are undecided, may have points of it.
struct Program {
  static constexpr Word kind_mask = 3, kind_leaf = 0, kind_unite = 1, kind_intersect = 2, kind_differ = 3;
  static constexpr Word negated = 4;  ///< a leaf whose complement is meant
  static constexpr Word whole =
      8;  ///< a leaf without state: all of the producer's half-spaces or facets are undecided
  static constexpr Word ranged = 16;  ///< a leaf whose state is a range of a lathe's facets
  static constexpr Word mute = 32;    ///< a leaf to which nothing ever belongs, since it is subtracted, or an
                                      ///< earlier operand says whose all is
  static constexpr Word known =
      64;  ///< a leaf that is IN; in the place of the producer the one that the cell belongs to (~0: none)
  static constexpr std::size_t header = 3;
};

}  // namespace bsp2::dataflow
