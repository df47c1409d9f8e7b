// bsp2-probe: measures the four numbers of this BSP computer, and stores them for the predictions.
//
//   mpirun -n P bsp2-probe [-o FILE] [--dry-run]
//
// p is the number of ranks. r is the rate of y += a x on vectors that fit in the cache. The time of
// supersteps with h-relations of growing size, in which every rank puts h bytes in 8-byte words cyclically to
// the others, is fitted by a line g h + l. This is what bspbench does (R. H. Bisseling, Parallel Scientific
// Computation, section 1.5), except that times are medians of repetitions and that the unit is the second,
// not the flop.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/memory.hpp"
#include "bsp2/bsplib/spmd.hpp"

namespace {

using namespace bsp2::bsplib;

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Flops a second of y += a x on 1024 elements.
double computing_rate() {
  constexpr std::size_t n = 1024;
  constexpr int repeat = 1000;
  std::vector<double> x(n, 1.0), y(n, 1.0), rates;
  double a = 1e-9;
  for (int sample = 0; sample < 21; ++sample) {
    const double begin = MPI_Wtime();
    for (int i = 0; i < repeat; ++i) {
      for (std::size_t k = 0; k < n; ++k) y[k] += a * x[k];
      a = -a + y[static_cast<std::size_t>(i) % n] * 1e-300;  // so that no repetition can be left out
    }
    rates.push_back(2.0 * n * repeat / (MPI_Wtime() - begin));
  }
  return median(rates);
}

/// Seconds of a superstep in which every rank puts `words` words to the others, in turn.
double superstep_seconds(World& world, Array<double>& array, std::size_t words) {
  const auto p = static_cast<std::size_t>(world.nprocs()), me = static_cast<std::size_t>(world.pid());
  const std::size_t per_rank = array.size() / p;
  std::vector<double> times;
  for (int sample = 0; sample < 31; ++sample) {
    world.sync();
    const double begin = MPI_Wtime();
    for (std::size_t i = 0, place = me * per_rank, to = 0; i < words; ++i) {
      if (to == me && p > 1) ++to;
      if (to == p) {
        to = me == 0 && p > 1 ? 1 : 0;
        ++place;
      }
      array.put(static_cast<int>(to++), 1.0, place);
    }
    world.sync();
    times.push_back(MPI_Wtime() - begin);
  }
  return median(times);
}

/// The line through the points, by least squares of the relative errors: small h-relations count as much as
/// large ones.
void fit(const std::vector<double>& h, const std::vector<double>& seconds, Machine& machine) {
  double w = 0, wh = 0, whh = 0, wt = 0, wht = 0;
  for (std::size_t i = 0; i < h.size(); ++i) {
    const double weight = 1.0 / (seconds[i] * seconds[i]);
    w += weight;
    wh += weight * h[i];
    whh += weight * h[i] * h[i];
    wt += weight * seconds[i];
    wht += weight * h[i] * seconds[i];
  }
  machine.g = std::max((w * wht - wh * wt) / (w * whh - wh * wh), 0.0);
  machine.l = std::max((wt - machine.g * wh) / w, 0.0);
}

/// What was measured, beside what g h + l says.
void print(const std::vector<double>& h, const std::vector<double>& seconds, const Machine& machine) {
  std::printf("%10s %14s %14s\n", "h / bytes", "measured / us", "g h + l / us");
  for (std::size_t i = 0; i < h.size(); ++i)
    std::printf("%10.0f %14.2f %14.2f\n", h[i], 1e6 * seconds[i], 1e6 * (machine.g * h[i] + machine.l));
}

Machine measure(World& world) {
  constexpr std::size_t most_words = 1U << 14U;
  Machine machine{.nprocs = world.nprocs()};
  Collectives<double> all(world);
  const auto slowest = [&](double x) {
    return all.reduce(x, [](double a, double b) { return std::max(a, b); });
  };
  machine.r = -slowest(-computing_rate());
  Array<double> array(world, (most_words + 1) * static_cast<std::size_t>(world.nprocs()));
  std::vector<double> h, seconds;
  for (std::size_t words = 0; words <= most_words; words = words == 0 ? 1 : 2 * words) {
    h.push_back(static_cast<double>(words * sizeof(double)));
    seconds.push_back(slowest(superstep_seconds(world, array, words)));
  }
  fit(h, seconds, machine);
  if (world.pid() == 0) print(h, seconds, machine);
  return machine;
}

void print_usage(std::FILE* to) {
  std::fprintf(to,
               "usage: mpirun -n P bsp2-probe [-o FILE] [--dry-run]\n"
               "Measures this machine's g, l and r for P processes, and stores them for the predictions.\n"
               "  -o FILE    store them there instead of %s\n"
               "  --dry-run  store nothing\n",
               machine_file().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  std::filesystem::path file = machine_file();
  bool store = true;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "-o") == 0 && i + 1 < argc) {
      file = argv[++i];
    } else if (std::strcmp(argv[i], "--dry-run") == 0) {
      store = false;
    } else if (std::strcmp(argv[i], "--help") == 0 || std::strcmp(argv[i], "-h") == 0) {
      print_usage(stdout);
      return 0;
    } else {
      print_usage(stderr);
      return 2;
    }
  }
  return spmd(argc, argv, [&](World& world) {
    const Machine machine = measure(world);
    if (world.pid() != 0) return;
    std::printf("p = %d, r = %.3f Gflop/s, g = %.3f ns/byte (%.1f flop/word), l = %.2f us (%.0f flop)\n",
                machine.nprocs, machine.r / 1e9, machine.g * 1e9, machine.g * 8 * machine.r, machine.l * 1e6,
                machine.l * machine.r);
    if (!store) return;
    store_machine(file, machine);
    std::printf("stored in %s\n", file.c_str());
  });
}
