#pragma once

#include <pthread.h>

#include <cstddef>
#include <exception>
#include <system_error>
#include <vector>

namespace bsp2::dataflow {

/// Programs may be nested a hundred thousand deep, and are walked by recursion: threads that do it get a stack for that
/// (address space only, until it is used).
inline constexpr std::size_t large_stack_bytes = std::size_t{256} << 20;

/// Starts a thread with a large stack. @param body must not throw.
inline pthread_t start_on_large_stack(void* (*body)(void*), void* argument) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, large_stack_bytes);
  pthread_t thread{};
  const int error = pthread_create(&thread, &attributes, body, argument);
  pthread_attr_destroy(&attributes);
  if (error != 0) throw std::system_error(error, std::generic_category(), "cannot start a thread");
  return thread;
}

/// Calls `function(i)` for each i < count at the same time, each on a large stack, and waits for all; passes on what one of them throws.
template <typename Function>
void call_on_large_stacks(std::size_t count, const Function& function) {
  struct Call {
    const Function* function;
    std::size_t index;
    std::exception_ptr failure;
    pthread_t thread;
  };
  const auto body = [](void* argument) -> void* {
    auto* self = static_cast<Call*>(argument);
    try {
      (*self->function)(self->index);
    } catch (...) {
      self->failure = std::current_exception();
    }
    return nullptr;
  };
  std::vector<Call> calls(count);
  std::exception_ptr failure;
  std::size_t started = 0;
  try {
    for (; started < count; ++started) {
      calls[started] = {&function, started, nullptr, {}};
      calls[started].thread = start_on_large_stack(body, &calls[started]);
    }
  } catch (...) {
    failure = std::current_exception();
  }
  for (std::size_t i = 0; i < started; ++i) {
    pthread_join(calls[i].thread, nullptr);
    if (!failure) failure = calls[i].failure;
  }
  if (failure) std::rethrow_exception(failure);
}

/// Calls `function` on a large stack and waits for it; passes on what it throws.
template <typename Function>
void call_on_large_stack(const Function& function) {
  call_on_large_stacks(1, [&](std::size_t) { function(); });
}

}  // namespace bsp2::dataflow
