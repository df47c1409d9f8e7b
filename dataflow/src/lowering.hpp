#pragma once

#include <array>
#include <limits>
#include <vector>

#include "bsp2/dataflow/network.hpp"
#include "bsp2/geometry/affine_map.hpp"
#include "bsp2/model/expression.hpp"

namespace bsp2::dataflow {

/// One occurrence of a primitive in the expanded expression, with the product of all maps above it.
template <int D>
struct Occurrence {
  const model::Primitive* primitive;
  geometry::Matrix<D> matrix;
};

/// The expression without transformers and complements: occurrences in source order, and Network's program over them.
template <int D>
struct Lowered {
  std::vector<Occurrence<D>> occurrences;
  std::vector<Word> program;
};

/// An axis-parallel box; empty where lower > upper, unbounded where infinite.
template <int D>
struct Box {
  std::array<double, D> lower, upper;
  static Box empty() {
    Box box;
    box.lower.fill(std::numeric_limits<double>::infinity());
    box.upper.fill(-std::numeric_limits<double>::infinity());
    return box;
  }
  static Box everything() {
    Box box = empty();
    std::swap(box.lower, box.upper);
    return box;
  }
  [[nodiscard]] bool is_empty() const;
  [[nodiscard]] bool is_finite() const;
  [[nodiscard]] bool touches(const std::array<double, D>& low, const std::array<double, D>& high) const;
  void unite(const Box& other);
  void intersect(const Box& other);
};

/// Walks the expression depth first, without recursion: it may be nested ten thousand deep.
template <int D>
Lowered<D> lower(const model::Expression& expression);

template <int D>
geometry::Matrix<D> compose(const geometry::Matrix<D>& outer, const geometry::Matrix<D>& inner);

/// A box that contains the solid; unbounded where only complements bound it.
template <int D>
Box<D> bounds_of(const Lowered<D>& lowered, const std::vector<Producer<D>>& producers);

template <int D>
Box<D> hull_of(const std::vector<Producer<D>>& producers);

}  // namespace bsp2::dataflow
