#include "bsp2/geometry/support/interruption.hpp"

#include <time.h>  // clock_gettime

#include <utility>

namespace bsp2::geometry {
namespace {

thread_local Interruption* innermost = nullptr;

/// Some milliseconds do not matter, and so it costs a few cycles where the exact time costs a hundred.
std::chrono::nanoseconds rough_time() {
#ifdef CLOCK_MONOTONIC_COARSE
  constexpr clockid_t clock = CLOCK_MONOTONIC_COARSE;
#else
  constexpr clockid_t clock = CLOCK_MONOTONIC;
#endif
  timespec now{};
  clock_gettime(clock, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

Interruption::Interruption(std::function<bool()> asked, std::chrono::milliseconds seldom)
    : asked_(std::move(asked)), seldom_(seldom), outer_(std::exchange(innermost, this)) {}

Interruption::~Interruption() { innermost = outer_; }

bool Interruption::is_over() { return innermost != nullptr && innermost->is_over_; }

bool Interruption::is_wanted() {
  Interruption* const own = innermost;
  if (own == nullptr || !own->asked_ || own->is_over_) return own != nullptr && own->is_over_;
  const auto now = rough_time();
  if (now - own->last_ < own->seldom_) return false;
  own->last_ = now;
  return own->is_over_ = own->asked_();
}

}  // namespace bsp2::geometry
