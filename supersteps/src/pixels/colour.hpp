#pragma once

#include <array>

namespace bsp2::supersteps {

using Colour = std::array<double, 3>;  ///< red, green, blue in [0, 1]

inline constexpr Colour background{0.965, 0.97, 0.975}, line_colour{0.12, 0.13, 0.16};

}  // namespace bsp2::supersteps
