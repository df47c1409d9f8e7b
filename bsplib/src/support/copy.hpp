#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace bsp2::bsplib {

/// By calls of memcpy: of a size that it knows the compiler makes `rep movsq` instead, which is as slow.
void copy_in_pieces(std::byte* to, const std::byte* from, std::size_t bytes);

/// Copies what may overlap, as a put to oneself may.
///
/// Two things beside memmove. Most of what is copied in small pieces are single words. And where the target
/// begins 1 to 31 bytes further into its page than the source, AMD's `rep movsb`, which the C library takes
/// for 2 KiB and more, is many times slower than otherwise: pieces too short for it do not suffer.
inline void copy_bytes(std::byte* to, const std::byte* from, std::size_t bytes) {
  constexpr std::size_t page = 4096;
  if (bytes == 8) {
    std::memcpy(to, from, 8);
    return;
  }
  const auto distance = reinterpret_cast<std::uintptr_t>(to) - reinterpret_cast<std::uintptr_t>(from);
  // The target is behind the end of the source, or lies nearly a page or more before it.
  if (bytes > 2048 && (distance % page) - 1 < 31 && distance >= bytes) {
    copy_in_pieces(to, from, bytes);
  } else {
    std::memmove(to, from, bytes);
  }
}

}  // namespace bsp2::bsplib
