#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "process/transformer.hpp"

namespace bsp2::dataflow {

/// One occurrence of a primitive in the expanded expression, with the product of all maps above it.
template <int D>
struct Occurrence {
  const model::Primitive* primitive;
  Transformer<D> placement;
  std::int32_t number;                    ///< Producer::primitive
  std::int32_t part = 0;                  ///< Producer::part
  const model::Colour* colour = nullptr;  ///< the outermost one around it
  std::uint32_t leaf = 0;                 ///< where it is in the program
  std::int32_t guard = -1;                ///< Producer::guard
  bool owns = true;                       ///< Producer::owns
};

/// The expression without transformers and complements: occurrences in source order, and Network's program
/// over them.
template <int D>
struct Lowered {
  std::vector<Occurrence<D>> occurrences;
  std::vector<Word> program;
  std::vector<Guard> guards;
  std::vector<Part> parts;  ///< that have a name; none: the whole is one
};

/// @param parts what divides it into parts.
/// Walks the expression depth first, without recursion: it may be nested ten thousand deep.
template <int D>
Lowered<D> lower(const model::Expression& expression, Parts parts = Parts::none);

/// A box that contains the solid; unbounded where only complements bound it.
template <int D>
Box<D> bounds_of(const Lowered<D>& lowered, const std::vector<Producer<D>>& producers);

template <int D>
Box<D> hull_of(const std::vector<Producer<D>>& producers);

}  // namespace bsp2::dataflow
