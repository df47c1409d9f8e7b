#pragma once

#include <gtest/gtest.h>

/// The dimensions as types, for typed tests.
namespace bsp2::samples {

template <int D>
struct Dimension {
  static constexpr int value = D;
};
using FirstDimensions = testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>>;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
/// The code is the same in all dimensions, and a sanitizer makes the highest ones very slow, to compile, too.
using Dimensions = FirstDimensions;
#else
using Dimensions =
    testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>, Dimension<6>>;
#endif

}  // namespace bsp2::samples
