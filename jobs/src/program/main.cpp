#include <malloc.h>

#include <csignal>
#include <iostream>

#include "program/program.hpp"

int main(int argc, char** argv) {
  // Large arrays go back to the system when they are freed, however many there have been: the next superstep
  // needs other sizes. Those that are not so large are used again: a page that comes new from the system
  // takes a microsecond.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  std::signal(
      SIGPIPE,
      SIG_IGN);  // `bsp2 run x | head -1`: writing fails instead, and the files are written all the same
  std::signal(SIGXFSZ, SIG_IGN);  // `ulimit -f`: likewise
  return bsp2::jobs::program({argv + 1, argv + argc}, std::cout);
}
