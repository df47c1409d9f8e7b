#pragma once

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

/// How many rounds a test on random input makes that needs all of them to meet what it looks for: `usual`.
/// BSP2_ROUNDS=x in the environment: x times as many, which may be fewer.
template <std::integral Integer>
Integer all_rounds(Integer usual) {
  const char* factor = std::getenv("BSP2_ROUNDS");
  return factor == nullptr ? usual
                           : static_cast<Integer>(std::ceil(static_cast<double>(usual) * std::atof(factor)));
}

/// As `all_rounds`, but a fifth of them under a sanitizer, which makes each many times slower and looks for
/// what is wrong wherever the program comes along. What is counted in them is expected in proportion.
template <std::integral Integer>
Integer rounds(Integer usual) {
  if (is_sanitized) usual = (usual + 4) / 5;
  return all_rounds(usual);
}

}  // namespace bsp2::samples
