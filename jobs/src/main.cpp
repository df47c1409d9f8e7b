#include <csignal>
#include <iostream>

#include "bsp2/jobs/program.hpp"

int main(int argc, char** argv) {
  std::signal(
      SIGPIPE,
      SIG_IGN);  // `bsp2 run x | head -1`: writing fails instead, and the files are written all the same
  return bsp2::jobs::program({argv + 1, argv + argc}, std::cout);
}
