// Several numbers in one instruction, as many as the processor at hand has room for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// A function that is compiled for several processors; the one at hand is chosen when the program starts. By
/// GCC: Clang of Debian 12 passes over the attribute, and sanitizers are not there yet when the choice is
/// made.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define BSP2_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define BSP2_VECTOR_CLONES
#endif

namespace bsp2::geometry {

inline constexpr std::size_t wide = 8;

using Lanes = double __attribute__((vector_size(4 * sizeof(double))));
using Bits = std::uint64_t __attribute__((vector_size(4 * sizeof(std::uint64_t))));
using WideLanes = double __attribute__((vector_size(wide * sizeof(double))));
using WideBits = std::uint64_t __attribute__((vector_size(wide * sizeof(std::uint64_t))));
using WideBytes = unsigned char __attribute__((vector_size(wide)));

/// Columns become rows.
[[gnu::always_inline]] inline void transpose(std::array<Lanes, 4>& m) {
  const Lanes a = __builtin_shufflevector(m[0], m[1], 0, 4, 2, 6),
              b = __builtin_shufflevector(m[0], m[1], 1, 5, 3, 7);
  const Lanes c = __builtin_shufflevector(m[2], m[3], 0, 4, 2, 6),
              d = __builtin_shufflevector(m[2], m[3], 1, 5, 3, 7);
  m[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  m[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  m[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  m[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

}  // namespace bsp2::geometry
