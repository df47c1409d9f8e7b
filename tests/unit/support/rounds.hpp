#pragma once

#include <cstdlib>

namespace bsp2::samples {

/// How many rounds a test on random input makes: `usual`, a fifth of them under a sanitizer, which makes each
/// many times slower and looks for what is wrong wherever the program comes along. BSP2_ROUNDS=n in the
/// environment: n times as many.
inline int rounds(int usual) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  usual = (usual + 4) / 5;
#endif
  const char* factor = std::getenv("BSP2_ROUNDS");
  return factor == nullptr ? usual : usual * std::atoi(factor);
}

}  // namespace bsp2::samples
