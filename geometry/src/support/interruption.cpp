#include "bsp2/geometry/support/interruption.hpp"

#include <utility>

namespace bsp2::geometry {
namespace {

thread_local Interruption* innermost = nullptr;

}  // namespace

Interruption::Interruption(std::function<bool()> asked, std::chrono::milliseconds seldom)
    : asked_(std::move(asked)), seldom_(seldom), outer_(std::exchange(innermost, this)) {}

Interruption::~Interruption() { innermost = outer_; }

bool Interruption::is_over() { return innermost != nullptr && innermost->is_over_; }

bool Interruption::is_wanted() {
  Interruption* const own = innermost;
  if (own == nullptr || !own->asked_ || own->is_over_) return own != nullptr && own->is_over_;
  const auto now = Clock::now();
  if (now - own->last_ < own->seldom_) return false;
  own->last_ = now;
  return own->is_over_ = own->asked_();
}

}  // namespace bsp2::geometry
