#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network.hpp"
#include "bsp2/dataflow/transformer.hpp"
#include "bsp2/model/expression.hpp"

namespace bsp2::dataflow {

/// One occurrence of a primitive in the expanded expression, with the product of all maps above it.
template <int D>
struct Occurrence {
  const model::Primitive* primitive;
  Transformer<D> placement;
  std::int32_t part;  ///< Producer::part
  const model::Colour* colour = nullptr;  ///< the outermost one around it
};

/// The expression without transformers and complements: occurrences in source order, and Network's program over them.
template <int D>
struct Lowered {
  std::vector<Occurrence<D>> occurrences;
  std::vector<Word> program;
  std::vector<std::pair<std::int32_t, std::string>> part_names;  ///< of the parts that have one
};

/// Walks the expression depth first, without recursion: it may be nested ten thousand deep.
template <int D>
Lowered<D> lower(const model::Expression& expression);

/// A box that contains the solid; unbounded where only complements bound it.
template <int D>
Box<D> bounds_of(const Lowered<D>& lowered, const std::vector<Producer<D>>& producers);

template <int D>
Box<D> hull_of(const std::vector<Producer<D>>& producers);

}  // namespace bsp2::dataflow
