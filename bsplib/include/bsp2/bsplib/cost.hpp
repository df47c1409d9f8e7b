#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <vector>

namespace bsp2::bsplib {

/// The four numbers of a BSP computer, in seconds instead of flops.
struct Machine {
  int nprocs = 1;
  double r = 0.0;  ///< computing rate, flop/s
  double g = 0.0;  ///< seconds a byte of an h-relation
  double l = 0.0;  ///< seconds a superstep costs at least
};

/// One superstep as this rank saw it. h-relations are bytes of payload, as the program asked for them.
struct SuperstepCost {
  std::uint64_t superstep = 0;
  double work_seconds = 0.0;      ///< between two syncs, on this rank
  double max_work_seconds = 0.0;  ///< w: the longest of all ranks
  double sync_seconds = 0.0;      ///< in sync, waiting for slower ranks included
  std::uint64_t bytes_out = 0, bytes_in = 0;
  std::uint64_t messages_out = 0, messages_in = 0;  ///< puts, gets and sends, after merging neighbours
  std::uint64_t h_bytes =
      0;  ///< h: the largest of bytes in and out of all ranks; complete after the next sync
  std::optional<double> predicted_seconds;  ///< w + g*h + l; none if the machine was never probed
};

/// w + g*h + l of a superstep on a machine.
double predict(const SuperstepCost& cost, const Machine& machine);

/// What a world spent so far: sums, and the last supersteps one by one.
struct CostReport {
  std::uint64_t supersteps = 0;
  double work_seconds = 0.0, sync_seconds = 0.0;
  double predicted_seconds = 0.0;  ///< sum over the supersteps that had a prediction
  std::uint64_t bytes_out = 0, bytes_in = 0, messages_out = 0, messages_in = 0;
  std::deque<SuperstepCost> recent;  ///< newest last
};

/// Where probed machines are kept: $BSP2_MACHINE, else $XDG_CONFIG_HOME/bsp2/machine.json, else
/// ~/.config/bsp2/machine.json.
std::filesystem::path machine_file();

/// The machines in a file, by number of processes; empty if there is no such file.
/// @throws std::runtime_error if the file is there and is not one of ours.
std::vector<Machine> load_machines(const std::filesystem::path& file);

/// The machine probed for this number of processes, or for the nearest one.
std::optional<Machine> find_machine(const std::vector<Machine>& machines, int nprocs);

/// Adds a machine to a file, in place of an older one with as many processes. The file is never half written.
/// @throws std::runtime_error if it cannot be written.
void store_machine(const std::filesystem::path& file, const Machine& machine);

}  // namespace bsp2::bsplib
