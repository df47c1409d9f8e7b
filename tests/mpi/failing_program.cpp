// The program bsp2, but it fails where the environment says:
//   BSP2_FAIL_AT     a superstep
//   BSP2_FAIL_RANK   on which rank
//   BSP2_FAIL_HOW    user: bsp2::Error; ours: std::logic_error; worker: a worker thread runs out of memory
#include <cstdlib>
#include <iostream>
#include <new>
#include <stdexcept>
#include <thread>

#include "bsp2/geometry/error.hpp"
#include "bsp2/jobs/program.hpp"

namespace {

std::thread::id main_thread;
bool workers_fail = false;

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

void* operator new(std::size_t size) {
  if (workers_fail && std::this_thread::get_id() != main_thread) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

int main(int argc, char** argv) {
  using namespace bsp2;
  main_thread = std::this_thread::get_id();
  supersteps::Ranks ranks = supersteps::Ranks::launched();
  const std::string at = variable("BSP2_FAIL_AT"), how = variable("BSP2_FAIL_HOW");
  if (variable("BSP2_FAIL_RANK") == std::to_string(ranks.rank()))
    ranks.on_superstep = [=](const std::string& name, unsigned) {
      if (name != at) return;
      if (how == "user") throw Error("injected mistake");
      if (how == "ours") throw std::logic_error("injected bug");
      workers_fail = true;
    };
  const auto run = [](const supersteps::RunOptions& options, supersteps::Ranks& all) { return supersteps::run(options, all); };
  return jobs::program({argv + 1, argv + argc}, std::cout, ranks, run);
}
