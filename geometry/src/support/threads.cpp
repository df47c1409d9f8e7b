#include "bsp2/geometry/support/threads.hpp"

#include <system_error>
#include <utility>

namespace bsp2::geometry {
namespace {

/// Where a thread may begin: a part of the processors that it may use.
struct Processors {
  cpu_set_t allowed, first;
};

/// Nothing if there is no choice, or it cannot be told.
std::optional<Processors> processors_for(Threads::Begin where) {
  Processors processors;
  const int at_hand = sched_getcpu();
  if (at_hand < 0 || sched_getaffinity(0, sizeof processors.allowed, &processors.allowed) != 0 ||
      CPU_COUNT(&processors.allowed) < 2)
    return std::nullopt;
  const auto own = static_cast<std::size_t>(at_hand);
  processors.first = processors.allowed;
  if (where == Threads::Begin::elsewhere) {
    CPU_CLR(own, &processors.first);
  } else {
    CPU_ZERO(&processors.first);
    CPU_SET(own, &processors.first);
  }
  return processors;
}

int create(pthread_t& thread, void* (*body)(void*), void* argument, std::size_t stack_bytes,
           const cpu_set_t* first) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  if (stack_bytes != 0) pthread_attr_setstacksize(&attributes, stack_bytes);
  if (first != nullptr) pthread_attr_setaffinity_np(&attributes, sizeof *first, first);
  const int error = pthread_create(&thread, &attributes, body, argument);
  pthread_attr_destroy(&attributes);
  return error;
}

}  // namespace

void Threads::start(std::function<void()> work, Begin where, std::size_t stack_bytes) {
  const auto processors = processors_for(where);
  Call& call = calls_.emplace_back(Call{std::move(work), {}, nullptr, {}});
  if (processors) call.allowed = processors->allowed;
  int error = create(call.thread, run, &call, stack_bytes, processors ? &processors->first : nullptr);
  if (error != 0 && processors) {  // a processor has just been taken from the process, or it may not choose
    call.allowed.reset();
    error = create(call.thread, run, &call, stack_bytes, nullptr);
  }
  if (error == 0) return;
  calls_.pop_back();
  throw std::system_error(error, std::generic_category(), "cannot start a thread");
}

void* Threads::run(void* self) {
  Call& call = *static_cast<Call*>(self);
  if (call.allowed) sched_setaffinity(0, sizeof *call.allowed, &*call.allowed);
  try {
    call.work();
  } catch (...) {
    call.failure = std::current_exception();
  }
  return nullptr;
}

void Threads::wait() {
  for (Call& call : calls_)
    if (call.thread != pthread_t{}) pthread_join(std::exchange(call.thread, {}), nullptr);
}

void Threads::join() {
  wait();
  const std::deque<Call> ended = std::exchange(calls_, {});
  for (const Call& call : ended)
    if (call.failure) std::rethrow_exception(call.failure);
}

}  // namespace bsp2::geometry
