#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/dataflow/mesh.hpp"
#include "bsp2/geometry/hyperplane_table.hpp"
#include "bsp2/model/expression.hpp"

namespace bsp2::dataflow {

/// One word of a program (see Network).
using Word = std::uint32_t;

/// A producer: one occurrence of a primitive, placed in the model.
///
/// A convex one is the intersection of half-spaces; one that is not convex is a placed triangle mesh.
/// Source: the paper, section 4.1, "Producers".
template <int D>
struct Producer {
  std::int32_t part = 0;                    ///< index of the primitive's occurrence in the source
  std::array<double, D> lower, upper;       ///< contain it, rounded outward
  std::uint32_t first_plane = 0, plane_count = 0;  ///< convex: its half-spaces, inside negative, in Network::planes
  std::int32_t mesh = -1;                   ///< index into Network::meshes, or -1 for a convex producer
  /// Code + 1 of the producer's own hyperplane that bounds it along an axis from below / above, or 0.
  std::array<std::array<std::uint32_t, 2>, D> bounding_plane{};
};

/// The compiled expression: producers, and the combiners over them as a flat program.
///
/// Transformers are gone: their maps are folded into the producers' hyperplanes. Complements are pushed down to the
/// leaves, nested combiners of one kind are one n-ary combiner. What is left is a tree in prefix order:
///   leaf      kind_leaf | negated, length, producer, state words
///   combiner  kind (unite, intersect, differ), length, part, operands
/// length counts all words of the subtree; part is the lowest part of the operands that were folded away as IN
/// (shifted by one, 0: none), for `differ` times two plus the parity of those operands.
template <int D>
struct Network {
  static constexpr Word kind_mask = 3, kind_leaf = 0, kind_unite = 1, kind_intersect = 2, kind_differ = 3;
  static constexpr Word negated = 4;
  static constexpr Word whole = 8;  ///< a leaf without state: all of the producer's half-spaces are undecided
  static constexpr std::size_t header = 3;

  geometry::HyperplaneTable<D> table;
  std::vector<Producer<D>> producers;
  std::vector<geometry::OrientedHyperplane> planes;
  std::vector<Mesh> meshes;  ///< D = 3 only
  std::vector<Word> program;  ///< empty: the solid is empty
  std::uint64_t primitive_count = 0;
  std::vector<std::string> warnings;  ///< of compilation, about constructs that came out empty

  [[nodiscard]] std::span<const geometry::OrientedHyperplane> planes_of(const Producer<D>& producer) const {
    return {planes.data() + producer.first_plane, producer.plane_count};
  }
};

struct CompileOptions {
  double coincidence = 1e-9;  ///< hyperplanes closer than this share of the bounding box are one
};

/// Lowers an expression to a network. @pre expression.dimension() == D.
/// A solid that only complements bound is cut off at the bounds of its primitives.
/// @throws bsp2::Error if lengths are too large or too small, absolutely or for each other.
/// Source: the paper, section 4.2, "Compilation".
template <int D>
Network<D> compile(const model::Expression& expression, const CompileOptions& options);

}  // namespace bsp2::dataflow
