#pragma once

#include <boost/mpi/environment.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>

#include "bsp2/bsplib/world.hpp"

namespace bsp2::bsplib {

namespace detail {

/// Whether the program of spmd() runs. A call of exit() in it would leave the other ranks without a word.
class Running {
 public:
  Running() {
    if (!std::exchange(registered_, true)) std::atexit(at_exit);
    running_ = true;
  }
  ~Running() { running_ = false; }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  static void at_exit() {
    int rank = 0;
    if (!running_) return;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    std::fprintf(stderr, "bsp2::bsplib: rank %d called exit() before its program had returned\n", rank);
    std::fflush(stderr);
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  static inline bool registered_ = false, running_ = false;
};

}  // namespace detail

/// main() of a BSP program: starts MPI for programs whose threads compute (MPI_THREAD_FUNNELED), runs the
/// program on a world of all ranks, and ends MPI. If it fails anywhere, rank 0 prints the agreed error.
/// A program that calls exit() ends all ranks with a message and code 1.
/// @return the exit code, equal on all ranks: 0, or 1 after an error.
template <class Program>
int spmd(int& argc, char**& argv, Program&& program) {
  boost::mpi::environment environment(argc, argv, boost::mpi::threading::funneled);
  int pid = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &pid);
  try {
    const detail::Running running;
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
