#pragma once

#include <type_traits>
#include <variant>

#include "bsp2/dataflow/shapes/paraboloid.hpp"
#include "bsp2/dataflow/shapes/round.hpp"
#include "bsp2/dataflow/shapes/torus.hpp"

namespace bsp2::dataflow {

/// Those that exist in D dimensions.
template <int D, typename Kept, typename... Rest>
struct Existing : std::type_identity<Kept> {};
template <int D, typename... Kept, typename First, typename... Rest>
struct Existing<D, std::variant<Kept...>, First, Rest...>
    : Existing<D,
               std::conditional_t<First::exists_in(D), std::variant<Kept..., First>, std::variant<Kept...>>,
               Rest...> {};

/// All kinds of round solids, a line each: see round_solid.hpp.
template <int D>
using RoundSolid = typename Existing<D, std::variant<>,
                                     Round<D>,       //
                                     Paraboloid<D>,  //
                                     Torus           //
                                     >::type;

template <typename Primitive, typename List>
struct FindPlaced : std::type_identity<void> {};
template <typename Primitive, typename First, typename... Rest>
struct FindPlaced<Primitive, std::variant<First, Rest...>>
    : std::conditional_t<std::is_same_v<typename First::Primitive, Primitive>, std::type_identity<First>,
                         FindPlaced<Primitive, std::variant<Rest...>>> {};

/// What a primitive of the model is when placed; void where there is none of D dimensions.
template <int D, typename Primitive>
using Placed = typename FindPlaced<Primitive, RoundSolid<D>>::type;

}  // namespace bsp2::dataflow
