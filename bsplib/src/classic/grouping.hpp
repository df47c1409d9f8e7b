#pragma once

#include <cstddef>

#include "bsp2/bsplib/cost.hpp"

/// How the collectives of classic programs are cut into supersteps: arithmetic that is the same on all
/// processes.
namespace bsp2::bsplib::classic {

/// p processes in consecutive groups of sizes that differ by one at most. In two supersteps, first within the
/// groups and then among them, each process hears of all with far fewer than p - 1 values. One group: there
/// is no second superstep.
///
/// Among the groups a process hears of group k by that member of k whose number in the group is its own,
/// modulo the size of k.
struct Groups {
  int processes = 1, count = 1;

  int begin(int group) const { return static_cast<int>(static_cast<long long>(processes) * group / count); }
  int size(int group) const { return begin(group + 1) - begin(group); }
  int of(int process) const;
  /// The process that tells `process` of a group.
  int teller(int group, int process) const;
  /// h of both supersteps together, in values.
  int h() const;
};

/// The groups with which a value of so many bytes travels from all to all in the shortest time.
Groups choose_groups(int processes, std::size_t bytes, const Machine& machine);

/// Whether a broadcast should first scatter its bytes.
bool scatters_first(int processes, std::size_t bytes, const Machine& machine);

}  // namespace bsp2::bsplib::classic
