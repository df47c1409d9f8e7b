// Many primitives, with progress and an end on demand: million_cubes [N] makes about N cubes, 1,000,000 if
// nobody says how many.

#include <bsp2/bsp2.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>

int main(int argc, char** argv) {
  const double wanted = argc > 1 ? std::atof(argv[1]) : 1e6;
  const int n = std::max(1, static_cast<int>(std::lround(std::cbrt(wanted))));

  // A lattice of cubes that do not touch. An expression is a pointer to what it shares with others: each of
  // these is a cube, the same for all, and a matrix.
  const bsp2::Expression cube = bsp2::cube(0.5);
  std::vector<bsp2::Expression> cubes;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z) cubes.push_back(cube.translate({double(x), double(y), double(z)}));
  const bsp2::Expression lattice = bsp2::unite(cubes);

  // While it is evaluated, this thread is asked whether to go on, and told how far it is.
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::minutes(10);
  bsp2::Options options;
  options.stop = [&] { return Clock::now() > deadline; };
  options.progress = [](const bsp2::Progress& now) {
    std::cerr << '\r' << now.superstep << ' ' << std::lround(100 * now.done) << " %, " << now.cells
              << " cells   ";
  };
  const bsp2::Result result = bsp2::evaluate(lattice, options);
  std::cerr << '\n';
  if (result.is_interrupted()) {
    std::cout << "stopped: it took too long\n";
    return 1;
  }
  std::cout << cubes.size() << " cubes, " << result.cells().size() << " cells, volume "
            << result.volume().least << '\n';
}
