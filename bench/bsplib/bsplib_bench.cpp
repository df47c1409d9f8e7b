// How much does the layer cost, compared with MPI by hand? Both run in turns, in one program:
//
//   mpirun -n 2 bsplib_bench [rounds] [--check]
//
// Each line is one superstep of N puts to the neighbour: microseconds by hand and by the layer (the lower
// decile of all rounds, of the slowest rank), their ratio, and the ratio that we promise. Then: does it
// matter how the same bytes are cut into accesses, and in which order these come? With --check the program
// fails if a promise is broken.
#include <algorithm>
#include <array>
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

  /// Typical times of several steps that take turns, so that a loaded machine disturbs them alike: well below
  /// the median, where other programs disturb least.
  std::vector<double> typical(const std::vector<Step>& steps, int repeat, int fewer = 1) const {
    std::vector<std::vector<double>> times(steps.size());
    for (int round = 0; round < std::max(5, rounds / fewer); ++round)
      for (std::size_t i = 0; i < steps.size(); ++i) times[i].push_back(seconds(steps[i], repeat));
    std::vector<double> result;
    for (auto& t : times) {
      const auto decile = static_cast<std::ptrdiff_t>(t.size() / 10);
      std::nth_element(t.begin(), t.begin() + decile, t.end());
      result.push_back(t[t.size() / 10]);
    }
    return result;
  }

  void compare(const std::string& name, const Step& by_hand, const Step& layer, double limit, int repeat) {
    const auto t = typical({by_hand, layer}, repeat);
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
  run("64 puts of 8 B, scattered", 64, 8, true, bsp_put, 1.3, 100);
  run("64 hpputs of 8 B, scattered", 64, 8, true, bsp_hpput, 1.3, 100);
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

/// The bytes of one bsp_put, cut into accesses of different sizes, over neighbouring places: times one
/// bsp_put of all.
struct Combinations {
  Bench& bench;
  World world{};
  std::vector<std::byte> local = std::vector<std::byte>(16 * mebi, std::byte{1}), memory = local;
  Array<std::byte> array{world, 16 * mebi};

  /// call(at, bytes) is inlined into the loop, as in a program; after() follows the sync.
  template <class Call, class After>
  Step step(std::size_t total, std::size_t bytes, Call call, After after) {
    return [this, total, bytes, call, after] {
      const auto access = call;  // in local variables, as a program would have them
      const std::size_t end = total, step = bytes;
      if (step == 8) {
        for (std::size_t at = 0; at < end; at += 8) access(at, std::size_t{8});
      } else {
        for (std::size_t at = 0; at < end; at += step) access(at, std::min(step, end - at));
      }
      bsp_sync();
      world.sync();
      after();
    };
  }

  template <class Call>
  void line(const char* name, std::size_t total, Call call) {
    line(name, total, call, [] {});
  }

  template <class Call, class After>
  void line(const char* name, std::size_t total, Call call, After after) {
    const auto put = [this](std::size_t at, std::size_t bytes) {
      bsp_put(bench.next, local.data() + at, memory.data(), static_cast<int>(at), static_cast<int>(bytes));
    };
    std::vector<Step> steps{step(total, total, put, [] {})};
    for (const std::size_t cut : cuts)
      if (cut < total) steps.push_back(step(total, cut, call, after));
    steps.push_back(step(total, total, call, after));
    const auto t = bench.typical(steps, total < mebi ? 10 : 1, total > mebi ? 20 : 1);
    if (bench.me != 0) return;
    std::printf("%8zu B, %-24s %10.2f ", total, name, 1e6 * t[0]);
    for (std::size_t i = 1; i < t.size(); ++i) {
      const double ratio = t[i] / t[0];
      bench.failed |= ratio > 3.0;
      if (i + 1 == t.size()) std::printf(" %*s", static_cast<int>(8 * (cuts.size() + 2 - t.size())), "");
      std::printf(" %6.2f%c", ratio, ratio > 3.0 ? '!' : ' ');
    }
    std::printf("\n");
  }

  void run() {
    bsp_push_reg(memory.data(), static_cast<int>(memory.size()));
    bsp_sync();
    if (bench.me == 0) {
      std::printf("\n%-36s %10s  cut into accesses of this many bytes; times one put\n%-36s %10s ",
                  "the same bytes", "one put/us", "", "");
      for (const std::size_t cut : cuts) std::printf(" %6zu ", cut);
      std::printf("    all\n");
    }
    const auto as_int = [](std::size_t n) { return static_cast<int>(n); };
    std::byte *mine = local.data(), *theirs = memory.data();
    Array<std::byte>* part = &array;
    const int to = bench.next;
    for (const std::size_t total : {std::size_t{8192}, std::size_t{65536}, mebi, 4 * mebi, 16 * mebi}) {
      line("bsp_put", total, [=](std::size_t at, std::size_t bytes) {
        bsp_put(to, mine + at, theirs, as_int(at), as_int(bytes));
      });
      line("bsp_hpput", total, [=](std::size_t at, std::size_t bytes) {
        bsp_hpput(to, mine + at, theirs, as_int(at), as_int(bytes));
      });
      line("bsp_get", total, [=](std::size_t at, std::size_t bytes) {
        bsp_get(to, theirs, as_int(at), mine + at, as_int(bytes));
      });
      line("bsp_hpget", total, [=](std::size_t at, std::size_t bytes) {
        bsp_hpget(to, theirs, as_int(at), mine + at, as_int(bytes));
      });
      line("Array::put", total, [=](std::size_t at, std::size_t bytes) {
        part->put(to, std::span<const std::byte>(mine + at, bytes), at);
      });
      line("Array::hpput", total, [=](std::size_t at, std::size_t bytes) {
        part->hpput(to, std::span<const std::byte>(mine + at, bytes), at);
      });
      line("Array::get", total, [=](std::size_t at, std::size_t bytes) {
        part->get(to, at, std::span<std::byte>(mine + at, bytes));
      });
      line("Array::hpget", total, [=](std::size_t at, std::size_t bytes) {
        part->hpget(to, at, std::span<std::byte>(mine + at, bytes));
      });
      const auto send = [=](std::size_t at, std::size_t bytes) {
        bsp_send(to, nullptr, mine + at, as_int(bytes));
      };
      line("bsp_send", total, send);
      line("bsp_send, bsp_move of all", total, send, [=] {
        int size = 0;
        std::byte* at = mine;
        for (bsp_get_tag(&size, nullptr); size >= 0; bsp_get_tag(&size, nullptr)) {
          bsp_move(at, size);
          at += size;
        }
      });
    }
    bsp_pop_reg(memory.data());
    bsp_sync();
  }

  static constexpr std::array<std::size_t, 7> cuts{8, 64, 1024, 4096, 16384, 65536, 262144};
};

/// The order in which n accesses of a size come to their places.
struct Order {
  const char* name;
  std::vector<std::size_t> (*places)(std::size_t n, std::size_t bytes);
};

constexpr std::array orders{
    Order{"strided",
          [](std::size_t n, std::size_t bytes) {
            std::vector<std::size_t> at(n);
            for (std::size_t i = 0; i < n; ++i) at[i] = 2 * i * bytes;
            return at;
          }},
    Order{"reversed",
          [](std::size_t n, std::size_t bytes) {
            std::vector<std::size_t> at(n);
            for (std::size_t i = 0; i < n; ++i) at[i] = (n - 1 - i) * bytes;
            return at;
          }},
    Order{"random", [](std::size_t n, std::size_t bytes) { return places(n, bytes, true); }},
};

/// Accesses that do not continue each other, against the same puts by hand, and against one put of as many
/// bytes.
void in_other_orders(Bench& bench) {
  constexpr std::size_t most = 4 * mebi;
  std::vector<std::byte> local(2 * most, std::byte{1}), memory(2 * most);
  ByHand hand(MPI_COMM_WORLD, 2 * most);
  bsp_push_reg(memory.data(), static_cast<int>(memory.size()));
  bsp_sync();
  if (bench.me == 0)
    std::printf("\n%-34s %10s  times the same puts by hand (times one put of all)\n%-34s %10s  %s\n",
                "accesses", "by hand/us", "", "",
                "     bsp_put         bsp_hpput       bsp_get         bsp_hpget       bsp_send");
  const auto as_int = [](std::size_t n) { return static_cast<int>(n); };
  std::byte *mine = local.data(), *theirs = memory.data();
  const int to = bench.next;
  for (const std::size_t total : {std::size_t{65536}, mebi, most})
    for (const std::size_t bytes : {std::size_t{8}, std::size_t{16}, std::size_t{64}, std::size_t{1024}})
      for (const Order& order : orders) {
        const auto at = order.places(total / bytes, bytes);
        const auto loop = [&](auto call) {
          return [&at, call] {
            for (const std::size_t place : at) call(place);
            bsp_sync();
          };
        };
        const auto t = bench.typical(
            {[&] {
               for (const std::size_t place : at) hand.put(mine + place, place, bytes);
               hand.sync(to, theirs, bytes);
             },
             [&] {
               bsp_put(to, mine, theirs, 0, as_int(total));
               bsp_sync();
             },
             loop([=](std::size_t i) { bsp_put(to, mine + i, theirs, as_int(i), as_int(bytes)); }),
             loop([=](std::size_t i) { bsp_hpput(to, mine + i, theirs, as_int(i), as_int(bytes)); }),
             loop([=](std::size_t i) { bsp_get(to, theirs, as_int(i), mine + i, as_int(bytes)); }),
             loop([=](std::size_t i) { bsp_hpget(to, theirs, as_int(i), mine + i, as_int(bytes)); }),
             loop([=](std::size_t i) { bsp_send(to, nullptr, mine + i, as_int(bytes)); })},
            total < mebi ? 5 : 1, total > mebi ? 10 : 4);
        if (bench.me != 0) continue;
        std::printf("%8zu B in %4zu B, %-12s %10.2f ", total, bytes, order.name, 1e6 * t[0]);
        for (std::size_t i = 2; i < t.size(); ++i) std::printf(" %6.2f (%6.2f)", t[i] / t[0], t[i] / t[1]);
        std::printf("\n");
      }
  bsp_pop_reg(memory.data());
  bsp_sync();
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
    Combinations{bench}.run();
    in_other_orders(bench);
    failed = check && bench.failed;
  }
  bsp_end();
  return failed ? 1 : 0;
}
