#pragma once

#include <pthread.h>

#include <cstddef>
#include <exception>
#include <system_error>

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

/// Calls `function` on a large stack and waits for it; passes on what it throws.
template <typename Function>
void call_on_large_stack(Function function) {
  struct Call {
    Function* function;
    std::exception_ptr failure;
  } call{&function, nullptr};
  const auto body = [](void* argument) -> void* {
    auto* self = static_cast<Call*>(argument);
    try {
      (*self->function)();
    } catch (...) {
      self->failure = std::current_exception();
    }
    return nullptr;
  };
  pthread_join(start_on_large_stack(body, &call), nullptr);
  if (call.failure) std::rethrow_exception(call.failure);
}

}  // namespace bsp2::dataflow
