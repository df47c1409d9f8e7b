#include <cstdio>
#include <functional>

#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/spmd.hpp"

using namespace bsp2::bsplib;

int main(int argc, char** argv) {
  return spmd(argc, argv, [](World& world) {
    Collectives<int> all(world);
    const int sum = all.reduce(world.pid() + 1, std::plus<>());
    if (sum != 3) world.fail("the sum is " + std::to_string(sum));
    if (world.pid() == 0) std::printf("sum %d\n", sum);
  });
}
