#include "classic/grouping.hpp"

#include <algorithm>

namespace bsp2::bsplib::classic {

int Groups::of(int process) const {
  int group = static_cast<int>(static_cast<long long>(process) * count / processes);
  while (begin(group) > process) --group;
  while (begin(group + 1) <= process) ++group;
  return group;
}

int Groups::teller(int group, int process) const {
  const int place = process - begin(of(process));
  return begin(group) + place % size(group);
}

/// The members of the smallest groups tell the most, where these are smaller than others.
int Groups::h() const {
  const int smallest = processes / count, largest = (processes + count - 1) / count;
  return largest - 1 + (count - 1) * ((largest + smallest - 1) / smallest);
}

Groups choose_groups(int processes, std::size_t bytes, const Machine& machine) {
  Groups best{processes, 1};
  const double value = machine.g * static_cast<double>(bytes);
  double least = value * (processes - 1) + machine.l;
  for (int count = 2; count < processes; ++count) {
    const Groups groups{processes, count};
    const double cost = value * groups.h() + 2 * machine.l;
    if (cost < least) least = cost, best = groups;
  }
  return best;
}

bool scatters_first(int processes, std::size_t bytes, const Machine& machine) {
  const double all = machine.g * static_cast<double>(bytes) * (processes - 1);
  return 2 * all / processes + machine.l < all;
}

}  // namespace bsp2::bsplib::classic
