#pragma once

#include <boost/mpi/environment.hpp>
#include <cstdio>
#include <exception>
#include <utility>

#include "bsp2/bsplib/world.hpp"

namespace bsp2::bsplib {

/// main() of a BSP program: starts MPI for programs whose threads compute (MPI_THREAD_FUNNELED), runs the
/// program on a world of all ranks, and ends MPI. If it fails anywhere, rank 0 prints the agreed error.
/// @return the exit code, equal on all ranks: 0, or 1 after an error.
template <class Program>
int spmd(int& argc, char**& argv, Program&& program) {
  boost::mpi::environment environment(argc, argv, boost::mpi::threading::funneled);
  int pid = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &pid);
  try {
    World world;
    supervise(world, std::forward<Program>(program));
    world.close();
    return 0;
  } catch (const std::exception& error) {
    if (pid == 0) std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

}  // namespace bsp2::bsplib
