#pragma once

#include <cstdint>

namespace bsp2::geometry {

inline constexpr std::uint32_t none = ~0u;  ///< where an index is: there is none

}  // namespace bsp2::geometry
