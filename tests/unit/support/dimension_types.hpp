#pragma once

#include <gtest/gtest.h>

/// The dimensions as types, for typed tests.
namespace bsp2::samples {

template <int D>
struct Dimension {
  static constexpr int value = D;
};
using Dimensions =
    testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>, Dimension<6>>;
using FirstDimensions = testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>>;

}  // namespace bsp2::samples
