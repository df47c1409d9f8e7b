// How much does the layer cost, compared with MPI by hand? Both run in turns, in one program:
//
//   mpirun -n 2 bsplib_bench [rounds] [--check]
//
// Each line is one superstep of N puts to the neighbour: microseconds by hand and by the layer (medians over
// all rounds, of the slowest rank), their ratio, and the ratio that we promise. Then: does it matter how the
// same bytes are cut into puts? With --check the program fails if a promise is broken.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "bsp.h"
#include "bsp2/bsplib/memory.hpp"
#include "by_hand.hpp"

namespace {

using namespace bsp2::bsplib;
using Step = std::function<void()>;

constexpr std::size_t mebi = std::size_t{1} << 20;

struct Bench {
  int rounds = 400;
  bool failed = false;
  int me = bsp_pid(), next = (bsp_pid() + 1) % bsp_nprocs();

  double seconds(const Step& step, int repeat) const {
    MPI_Barrier(MPI_COMM_WORLD);
    const double begin = MPI_Wtime();
    for (int i = 0; i < repeat; ++i) step();
    double mine = (MPI_Wtime() - begin) / repeat, slowest = 0.0;
    MPI_Allreduce(&mine, &slowest, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    return slowest;
  }

  /// Medians of several steps that take turns, so that a loaded machine disturbs them alike.
  std::vector<double> medians(const std::vector<Step>& steps, int repeat) const {
    std::vector<std::vector<double>> times(steps.size());
    for (int round = 0; round < rounds; ++round)
      for (std::size_t i = 0; i < steps.size(); ++i) times[i].push_back(seconds(steps[i], repeat));
    std::vector<double> result;
    for (auto& t : times) {
      std::nth_element(t.begin(), t.begin() + t.size() / 2, t.end());
      result.push_back(t[t.size() / 2]);
    }
    return result;
  }

  void compare(const std::string& name, const Step& by_hand, const Step& layer, double limit, int repeat) {
    const auto t = medians({by_hand, layer}, repeat);
    const double ratio = t[1] / t[0];
    failed |= limit > 0.0 && ratio > limit;
    if (me == 0) {
      std::printf("%-44s %10.2f %10.2f %7.2f", name.c_str(), 1e6 * t[0], 1e6 * t[1], ratio);
      limit > 0.0 ? std::printf("   <= %.1f%s\n", limit, ratio > limit ? "  BROKEN" : "") : std::printf("\n");
    }
  }
};

/// Places of n puts of a size in memory: one after the other, or in random order with gaps.
std::vector<std::size_t> places(std::size_t n, std::size_t bytes, bool scattered) {
  std::vector<std::size_t> at(n);
  for (std::size_t i = 0; i < n; ++i) at[i] = i * bytes * (scattered ? 2 : 1);
  if (scattered) std::shuffle(at.begin(), at.end(), std::mt19937(1));
  return at;
}

void against_mpi(Bench& bench) {
  World world;
  std::vector<std::byte> source(mebi, std::byte{1}), memory(2 * mebi);
  Array<std::byte> array(world, 2 * mebi);
  ByHand hand(MPI_COMM_WORLD, 4 * mebi);
  bsp_push_reg(memory.data(), static_cast<int>(memory.size()));
  bsp_sync();

  if (bench.me == 0) std::printf("%-44s %10s %10s %7s\n", "one superstep", "by hand/us", "layer/us", "ratio");
  const auto by_hand = [&](const std::vector<std::size_t>& at, std::size_t bytes) {
    return [&hand, &bench, &source, &memory, at, bytes] {
      for (const std::size_t place : at) hand.put(source.data() + (place % mebi), place, bytes);
      hand.sync(bench.next, memory.data(), bytes);
    };
  };
  const auto classic = [&](const std::vector<std::size_t>& at, std::size_t bytes, auto put) {
    return [&bench, &source, &memory, at, bytes, put] {
      for (const std::size_t place : at)
        put(bench.next, source.data() + (place % mebi), memory.data(), static_cast<int>(place),
            static_cast<int>(bytes));
      bsp_sync();
    };
  };
  const auto run = [&](const char* name, std::size_t n, std::size_t bytes, bool scattered, auto put,
                       double limit, int repeat) {
    const auto at = places(n, bytes, scattered);
    bench.compare(name, by_hand(at, bytes), classic(at, bytes, put), limit, repeat);
  };
  run("empty", 0, 1, false, bsp_put, 1.5, 100);
  run("1 put of 8 B", 1, 8, false, bsp_put, 0.0, 100);
  run("1000 puts of 8 B, neighbouring", 1000, 8, false, bsp_put, 1.3, 20);
  run("1000 puts of 8 B, scattered", 1000, 8, true, bsp_put, 1.3, 20);
  run("1000 hpputs of 8 B, neighbouring", 1000, 8, false, bsp_hpput, 1.3, 20);
  run("1000 hpputs of 8 B, scattered", 1000, 8, true, bsp_hpput, 1.3, 20);
  run("100 puts of 1 KiB, neighbouring", 100, 1024, false, bsp_put, 1.1, 10);
  run("100 puts of 1 KiB, scattered", 100, 1024, true, bsp_put, 1.1, 10);
  run("1 put of 1 MiB", 1, mebi, false, bsp_put, 1.1, 3);
  run("1 hpput of 1 MiB", 1, mebi, false, bsp_hpput, 1.1, 3);
  bench.compare(
      "1 put of 1 MiB into memory of the layer", by_hand({0}, mebi),
      [&] {
        array.put(bench.next, source, 0);
        world.sync();
      },
      0.0, 3);
  bench.compare(
      "1 hpput of 1 MiB into memory of the layer", by_hand({0}, mebi),
      [&] {
        array.hpput(bench.next, source, 0);
        world.sync();
      },
      0.4, 3);
  bsp_pop_reg(memory.data());
  bsp_sync();
}

/// The same bytes, cut into puts of different sizes, neighbouring ones.
void combinations(Bench& bench) {
  World world;
  std::vector<std::byte> source(mebi, std::byte{1}), memory(mebi);
  Registered<std::byte> registered(world, memory);
  Array<std::byte> array(world, mebi);
  world.sync();
  const std::span<const std::byte> data(source);
  const auto step = [&](auto& target, auto put, std::size_t total, std::size_t bytes) -> Step {
    return [&target, &world, &bench, put, total, bytes, data] {
      for (std::size_t at = 0; at < total; at += bytes)
        (target.*put)(bench.next, data.subspan(at, std::min(bytes, total - at)), at);
      world.sync();
    };
  };
  using Target = Distributed<std::byte>;
  using Put = void (Target::*)(int, std::span<const std::byte>, std::size_t);
  const Put buffered = &Target::put, unbuffered = &Target::hpput;
  if (bench.me == 0)
    std::printf("\n%-28s %10s  times that of one put, cut into puts of this many bytes\n%-28s %10s",
                "the same bytes", "one put/us", "", "");
  const std::vector<std::size_t> cuts{8, 64, 1000, 4096, 16384, 20000, 65536, 262144};
  for (const std::size_t cut : cuts)
    if (bench.me == 0) std::printf(" %7zu", cut);
  if (bench.me == 0) std::printf("\n");
  const std::pair<Put, const char*> puts[] = {{buffered, "put"}, {unbuffered, "hpput"}};
  for (const std::size_t total : {std::size_t{8000}, std::size_t{65536}, mebi})
    for (const auto& [put, name] : puts)
      for (const bool own : {false, true}) {
        Target& target = own ? static_cast<Target&>(array) : registered;
        std::vector<Step> steps{step(target, buffered, total, total)};
        for (const std::size_t cut : cuts)
          if (cut < total) steps.push_back(step(target, put, total, cut));
        const auto t = bench.medians(steps, total == mebi ? 2 : 10);
        if (bench.me == 0)
          std::printf("%7zu B, %-5s, %-9s %13.2f ", total, name, own ? "layer's" : "program's", 1e6 * t[0]);
        for (std::size_t i = 1; i < t.size(); ++i) {
          bench.failed |= t[i] / t[0] > 3.0;
          if (bench.me == 0) std::printf(" %6.2f%c", t[i] / t[0], t[i] / t[0] > 3.0 ? '!' : ' ');
        }
        if (bench.me == 0) std::printf("\n");
      }
}

}  // namespace

int main(int argc, char** argv) {
  bsp_begin(bsp_nprocs());
  bool failed = false;
  {
    Bench bench;
    bool check = false;
    for (int i = 1; i < argc; ++i) {
      if (std::strcmp(argv[i], "--check") == 0)
        check = true;
      else
        bench.rounds = std::max(1, std::atoi(argv[i]));
    }
    against_mpi(bench);
    combinations(bench);
    failed = check && bench.failed;
  }
  bsp_end();
  return failed ? 1 : 0;
}
