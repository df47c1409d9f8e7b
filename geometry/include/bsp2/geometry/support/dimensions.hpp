#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "bsp2/geometry/support/error.hpp"

/// The dimensions in which everything works. `macro(D)` instantiates a room's templates for one of them:
///
///   #define BSP2_INSTANTIATE(D) template class Splitter<D>;
///   BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
///   #undef BSP2_INSTANTIATE
///
/// A build for 3 or 4 dimensions (cmake -DBSP2_DIMENSIONS=4) reads models of 6, too, and refuses to evaluate
/// them.
#ifndef BSP2_DIMENSIONS
#define BSP2_DIMENSIONS 6
#endif
#if BSP2_DIMENSIONS == 6
#define BSP2_FOR_EACH_DIMENSION(macro) macro(1) macro(2) macro(3) macro(4) macro(5) macro(6)
#elif BSP2_DIMENSIONS == 4
#define BSP2_FOR_EACH_DIMENSION(macro) macro(1) macro(2) macro(3) macro(4)
#elif BSP2_DIMENSIONS == 3
#define BSP2_FOR_EACH_DIMENSION(macro) macro(1) macro(2) macro(3)
#else
#error "BSP2_DIMENSIONS is 3, 4 or 6"
#endif

namespace bsp2::geometry {

/// No solid has more.
inline constexpr int most_dimensions = 6;
/// The last one of `BSP2_FOR_EACH_DIMENSION`.
inline constexpr int built_dimensions = BSP2_DIMENSIONS;

[[nodiscard]] constexpr bool is_dimension(int dimension) {
  return dimension >= 1 && dimension <= most_dimensions;
}

/// The dimension of a model is known at run time, those of the templates before it.
/// @return use(std::integral_constant<int, D>()) for the D that is `dimension`.
/// @throws bsp2::Error outside of 1 .. most_dimensions.
template <int D = 1, typename Use>
auto in_dimension(int dimension, Use&& use) {
  if (!is_dimension(dimension))
    throw Error("solids of dimension 1 to " + std::to_string(most_dimensions) + " can be evaluated, not " +
                std::to_string(dimension));
  if (dimension > built_dimensions)
    throw Error("this program is built for solids of up to " + std::to_string(built_dimensions) +
                " dimensions: build it with -DBSP2_DIMENSIONS=" + std::to_string(most_dimensions));
  if constexpr (D < built_dimensions)
    if (dimension != D) return in_dimension<D + 1>(dimension, std::forward<Use>(use));
  return use(std::integral_constant<int, D>());
}

}  // namespace bsp2::geometry
