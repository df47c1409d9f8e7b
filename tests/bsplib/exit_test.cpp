// exit_test <case>: programs whose end, or whose memory, is the point.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bsp2/bsplib/memory.hpp"
#include "bsp2/bsplib/spmd.hpp"

namespace {

using namespace bsp2::bsplib;

/// Arrays of 1 MB and 30 MB, in the world and in its parts: whether they are shared or not, they work.
void use_arrays(World& world) {
  for (const std::size_t size : {1000000U, 30000000U}) {
    const std::vector<char> data(size, 'x');
    Array<char> array(world, size);
    array.put((world.pid() + 1) % world.nprocs(), std::span(data).first(size / 2), 0);
    array.hpput((world.pid() + 1) % world.nprocs(), std::span(data).subspan(size / 2), size / 2);
    world.sync();
    if (!std::ranges::equal(array.local(), data)) world.fail("The array is not what was written");
  }
  World part = world.split(world.pid() % 2);
  Array<int> numbers(part, static_cast<std::size_t>(part.nprocs()));
  for (int pid = 0; pid < part.nprocs(); ++pid)
    numbers.put(pid, world.pid() + 1, static_cast<std::size_t>(part.pid()));
  part.sync();
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (numbers[i] != world.pid() % 2 + 2 * static_cast<int>(i) + 1)
      world.fail("The part is not what was written");
  part.sync();
}

}  // namespace

int main(int argc, char** argv) {
  const std::string wanted = argc > 1 ? argv[1] : "";
  const int code = spmd(argc, argv, [&](World& world) {
    if (wanted == "array") use_arrays(world);
    world.sync();
    if (wanted == "exit" && world.pid() == world.nprocs() - 1) std::exit(0);
    world.sync();
  });
  std::puts("returned");
  return code;
}
