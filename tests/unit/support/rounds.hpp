#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdlib>

namespace bsp2::samples {

/// Whether the program is built with a sanitizer, which makes it many times slower: bounds of time are those
/// of others.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool is_sanitized = true;
#else
inline constexpr bool is_sanitized = false;
#endif

/// BSP2_ROUNDS=x in the environment: x times as many rounds of each test on random input.
inline double rounds_factor() {
  const char* factor = std::getenv("BSP2_ROUNDS");
  return factor == nullptr ? 1 : std::atof(factor);
}

/// How many rounds a test on random input makes that needs all of them to meet what it looks for: `usual`, or
/// more by BSP2_ROUNDS, never fewer.
template <std::integral Integer>
Integer all_rounds(Integer usual) {
  return static_cast<Integer>(std::ceil(static_cast<double>(usual) * std::max(1.0, rounds_factor())));
}

/// How many rounds a test makes whose counts are expected in proportion: `usual` times BSP2_ROUNDS, which may
/// be below 1. A fifth of them under a sanitizer, which makes each many times slower and looks for what is
/// wrong wherever the program comes along; BSP2_ROUNDS=0.2 shows in any build what is left of a test there.
template <std::integral Integer>
Integer rounds(Integer usual) {
  if (is_sanitized) usual = (usual + 4) / 5;
  return static_cast<Integer>(std::ceil(static_cast<double>(usual) * rounds_factor()));
}

}  // namespace bsp2::samples
