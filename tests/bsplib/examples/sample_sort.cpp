#include <algorithm>
#include <boost/serialization/vector.hpp>
#include <cstdio>
#include <random>
#include <vector>

#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/spmd.hpp"

using namespace bsp2::bsplib;
using Numbers = std::vector<double>;

/// Sorts n random numbers a rank: local sort, p samples of each to all, splitters, one message a pair of
/// ranks.
int main(int argc, char** argv) {
  return spmd(argc, argv, [](World& world) {
    const std::size_t n = 10000, p = static_cast<std::size_t>(world.nprocs());
    Collectives<Numbers> all(world);
    std::mt19937 random(static_cast<unsigned>(world.pid()));
    Numbers x(n), mine, samples, sorted;
    std::generate(x.begin(), x.end(), [&] { return std::uniform_real_distribution<>()(random); });
    std::sort(x.begin(), x.end());

    for (std::size_t i = 0; i < p; ++i) mine.push_back(x[i * (n / p)]);
    for (const Numbers& s : all.all_gather(mine)) samples.insert(samples.end(), s.begin(), s.end());
    std::sort(samples.begin(), samples.end());  // every p-th sample is a splitter

    std::vector<Numbers> parts;
    for (auto begin = x.begin(); parts.size() < p;) {
      const bool last = parts.size() == p - 1;
      const auto end = last ? x.end() : std::lower_bound(begin, x.end(), samples[(parts.size() + 1) * p]);
      parts.emplace_back(begin, end);
      begin = end;
    }
    for (const Numbers& part : all.all_to_all(parts)) sorted.insert(sorted.end(), part.begin(), part.end());
    std::sort(sorted.begin(), sorted.end());

    const Numbers ends = sorted.empty() ? Numbers() : Numbers{sorted.front(), sorted.back()};
    Numbers borders;
    for (const Numbers& e : all.all_gather(ends)) borders.insert(borders.end(), e.begin(), e.end());
    if (!std::is_sorted(borders.begin(), borders.end())) world.fail("the parts are not in order");
    std::printf("rank %d has %zu numbers\n", world.pid(), sorted.size());
  });
}
