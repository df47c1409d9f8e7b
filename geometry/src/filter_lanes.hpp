// Hyperplanes held against many points at a time, for the filter of the predicate: its bound covers any rounding, so every processor may
// use the widest instructions it has.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>

#include "bsp2/geometry/hyperplane.hpp"

#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BSP2_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define BSP2_VECTOR_CLONES
#endif

namespace bsp2::geometry {

using Lanes = double __attribute__((vector_size(4 * sizeof(double))));
using WideLanes = double __attribute__((vector_size(8 * sizeof(double))));
using WideBytes = unsigned char __attribute__((vector_size(8)));

/// The least and the largest value of a hyperplane over points, a multiple of 4 of them, until they are beyond `bound` on both sides.
/// @return the number of points looked at.
[[gnu::always_inline]] inline std::size_t find_range(const double* x, const double* y, const double* z, std::size_t count, const Hyperplane<3>& h, double bound,
                                                     double& least, double& largest) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Lanes low = {infinity, infinity, infinity, infinity}, high = -low;
  std::size_t at = 0;
  do {
    for (const std::size_t end = std::min(at + 32, count); at < end; at += 4) {
      Lanes xs, ys, zs;
      std::memcpy(&xs, x + at, sizeof xs);
      std::memcpy(&ys, y + at, sizeof ys);
      std::memcpy(&zs, z + at, sizeof zs);
      const Lanes value = h.offset + h.normal[0] * xs + h.normal[1] * ys + h.normal[2] * zs;
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    least = std::min(std::min(low[0], low[1]), std::min(low[2], low[3]));
    largest = std::max(std::max(high[0], high[1]), std::max(high[2], high[3]));
  } while (at < count && !(least < -bound && largest > bound));
  return at;
}

}  // namespace bsp2::geometry
