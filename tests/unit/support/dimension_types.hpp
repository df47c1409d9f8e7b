#pragma once

#include <gtest/gtest.h>

#include "bsp2/geometry/support/dimensions.hpp"

/// The dimensions as types, for typed tests.
namespace bsp2::samples {

template <int D>
struct Dimension {
  static constexpr int value = D;
};
using FirstDimensions = testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>>;
#if BSP2_DIMENSIONS == 4
using Dimensions = FirstDimensions;
#else
using Dimensions =
    testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>, Dimension<6>>;
#endif

}  // namespace bsp2::samples
