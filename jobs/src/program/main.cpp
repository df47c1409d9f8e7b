#include <malloc.h>

#include <csignal>
#include <iostream>
#include <thread>

#include "program/program.hpp"

namespace {

/// Memory that is freed is used again, also where it was a large array or another thread's: a page that comes
/// new from the system takes a microsecond, and of a surface's time that was a fifth. What lies free at the
/// end of a superstep goes back (malloc_trim), as do the largest arrays at once.
void keep_freed_memory() {
  constexpr int mebibyte = 1 << 20;
  constexpr unsigned threads_an_arena = 4;  // more seldom wait for each other; each arena keeps its own
  mallopt(M_MMAP_THRESHOLD, 64 * mebibyte);
  mallopt(M_TRIM_THRESHOLD, 128 * mebibyte);
  mallopt(M_TOP_PAD, 8 * mebibyte);
  mallopt(M_ARENA_MAX, static_cast<int>(1 + std::thread::hardware_concurrency() / threads_an_arena));
}

}  // namespace

int main(int argc, char** argv) {
  keep_freed_memory();
  std::signal(
      SIGPIPE,
      SIG_IGN);  // `bsp2 run x | head -1`: writing fails instead, and the files are written all the same
  std::signal(SIGXFSZ, SIG_IGN);  // `ulimit -f`: likewise
  return bsp2::jobs::program({argv + 1, argv + argc}, std::cout);
}
