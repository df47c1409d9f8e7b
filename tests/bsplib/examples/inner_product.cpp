#include <cstdio>
#include <functional>

#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/spmd.hpp"

using namespace bsp2::bsplib;

/// Inner product of x = y = (1, ..., n), distributed cyclically.
int main(int argc, char** argv) {
  return spmd(argc, argv, [](World& world) {
    const int n = 1000;
    Collectives<double> all(world);
    double part = 0.0;
    for (int i = world.pid(); i < n; i += world.nprocs()) part += (i + 1.0) * (i + 1.0);
    const double sum = all.reduce(part, std::plus<>());
    if (sum != n * (n + 1.0) * (2 * n + 1.0) / 6) world.fail("wrong sum " + std::to_string(sum));
    if (world.pid() == 0) std::printf("sum = %.0f\n", sum);
  });
}
