// The program bsp2, but it fails where the environment says:
//   BSP2_FAIL_AT     a superstep
//   BSP2_FAIL_RANK   on which rank
//   BSP2_FAIL_HOW    user: bsp2::Error; ours: std::logic_error; worker: worker threads have no memory in it;
//                    busy: bsp2::Error, while all others are busy for an hour
//                    stopped: SIGSTOP; asleep: for an hour; computing: for five seconds, and nothing fails
//                    main:N or worker:N: the N-th allocation, from there on, of the main thread or of workers
//                    fails
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <new>
#include <stdexcept>
#include <thread>

#include "bsp2/api/evaluation/ranks.hpp"
#include "program/program.hpp"

namespace {

std::thread::id main_thread;
bool workers_fail = false;
std::atomic<long> main_allocations{-1}, worker_allocations{-1};  // until one fails; negative: none will

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

void* operator new(std::size_t size) {
  const bool is_main = std::this_thread::get_id() == main_thread;
  if (workers_fail && !is_main) throw std::bad_alloc();
  std::atomic<long>& left = is_main ? main_allocations : worker_allocations;
  if (left >= 0 && left-- == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

int main(int argc, char** argv) {
  using namespace bsp2;
  main_thread = std::this_thread::get_id();
  const Ranks all(std::make_shared<Ranks::Implementation>(supersteps::Ranks::launched()));
  supersteps::Ranks& ranks = all.implementation()->ranks;
  const std::string at = variable("BSP2_FAIL_AT"), how = variable("BSP2_FAIL_HOW");
  if (how == "busy")
    ranks.on_superstep = [=](const std::string& name, unsigned) {
      if (name == at) std::this_thread::sleep_for(std::chrono::hours(1));
    };
  if (variable("BSP2_FAIL_RANK") == std::to_string(ranks.rank()))
    ranks.on_superstep = [=](const std::string& name, unsigned) {
      workers_fail = false;
      if (name != at) return;
      if (how == "user" || how == "busy") throw Error("injected mistake");
      if (how == "ours") throw std::logic_error("injected bug");
      if (how == "stopped") raise(SIGSTOP);
      if (how == "asleep") std::this_thread::sleep_for(std::chrono::hours(1));
      if (how == "computing")
        for (const auto begin = std::chrono::steady_clock::now();
             std::chrono::steady_clock::now() - begin < std::chrono::seconds(5);) {
        }
      if (how == "stopped" || how == "asleep" || how == "computing") return;
      const auto colon = how.find(':');
      if (colon == std::string::npos)
        workers_fail = true;
      else
        (how.starts_with("main") ? main_allocations : worker_allocations) =
            std::atol(how.c_str() + colon + 1);
    };
  return jobs::program({argv + 1, argv + argc}, std::cout, all);
}
