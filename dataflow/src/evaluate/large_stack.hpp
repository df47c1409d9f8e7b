#pragma once

#include <cstddef>

#include "bsp2/geometry/support/threads.hpp"

namespace bsp2::dataflow {

/// Programs may be nested a hundred thousand deep, and are walked by recursion: threads that do it get a
/// stack for that (address space only, until it is used).
inline constexpr std::size_t large_stack_bytes = std::size_t{256} << 20;

/// Calls `function(i)` for each i < count at the same time, each on a large stack, and waits for all; passes
/// on what one of them throws.
template <typename Function>
void call_on_large_stacks(std::size_t count, const Function& function) {
  using Begin = geometry::Threads::Begin;
  geometry::Threads threads;
  for (std::size_t i = count; i-- > 0;)  // the one that begins here last: it takes the processor
    threads.start([&function, i] { function(i); }, i == 0 ? Begin::here : Begin::elsewhere,
                  large_stack_bytes);
  threads.join();
}

/// Calls `function` on a large stack and waits for it; passes on what it throws.
template <typename Function>
void call_on_large_stack(const Function& function) {
  call_on_large_stacks(1, [&](std::size_t) { function(); });
}

}  // namespace bsp2::dataflow
