#include "classic/speaker.hpp"

#include <mpi.h>

#include <chrono>
#include <cstdlib>
#include <thread>

namespace bsp2::bsplib::classic {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds patience{300}, pause{1};
constexpr milliseconds most_silence{5000};  ///< of one that another process should have ended

/// On MPI_COMM_WORLD, which the layer uses for nothing else; MPI grants tags up to here everywhere.
enum Tag : int { failed = 32766, speaks = 32767 };

void tell(Tag tag, int rank, int processes) {
  for (int other = 0; other < processes; ++other) {
    if (other == rank) continue;
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Isend(nullptr, 0, MPI_BYTE, other, tag, MPI_COMM_WORLD, &request);
    if (request != MPI_REQUEST_NULL) MPI_Request_free(&request);
  }
}

bool has_come(int from, Tag tag) {
  int there = 0;
  MPI_Iprobe(from, tag, MPI_COMM_WORLD, &there, MPI_STATUS_IGNORE);
  return there != 0;
}

bool another_speaks(int rank) {
  if (has_come(MPI_ANY_SOURCE, speaks)) return true;
  for (int lower = 0; lower < rank; ++lower)
    if (has_come(lower, failed)) return true;
  return false;
}

/// Before MPI has begun nobody can be asked: all but the first give that one the time to end them.
void wait_in_order() {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"})
    if (const char* rank = std::getenv(name)) {
      if (std::atoi(rank) > 0) std::this_thread::sleep_for(patience);
      return;
    }
}

}  // namespace

void wait_to_speak(int processes) {
  int initialized = 0, finalized = 0, rank = 0;
  MPI_Initialized(&initialized);
  MPI_Finalized(&finalized);
  if (!initialized || finalized) return wait_in_order();
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  tell(failed, rank, processes);
  const auto begin = Clock::now();
  bool silent = another_speaks(rank);
  while (!silent && rank > 0 && Clock::now() - begin < patience) {
    std::this_thread::sleep_for(pause);
    silent = another_speaks(rank);
  }
  while (silent && Clock::now() - begin < most_silence) {
    std::this_thread::sleep_for(pause);
    has_come(MPI_ANY_SOURCE, speaks);  // MPI goes on
  }
  tell(speaks, rank, processes);
}

}  // namespace bsp2::bsplib::classic
