#include "support/copy.hpp"

#include "bsp2/bsplib/run.h"

namespace bsp2::bsplib {

void copy_in_pieces(std::byte* to, const std::byte* from, std::size_t bytes) {
  std::size_t piece = 1024;
  asm volatile("" : "+r"(piece));  // the compiler does not know it any more
  for (; bytes > piece; to += piece, from += piece, bytes -= piece) std::memcpy(to, from, piece);
  std::memcpy(to, from, bytes);
}

}  // namespace bsp2::bsplib

void bsp2_copy_much(char* place, const void* source, size_t bytes) {
  bsp2::bsplib::copy_bytes(reinterpret_cast<std::byte*>(place), static_cast<const std::byte*>(source), bytes);
}
