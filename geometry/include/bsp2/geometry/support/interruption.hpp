#pragma once

#include <chrono>
#include <functional>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::geometry {

/// What is thrown through work that somebody has ended before it was done.
class Interrupted : public Error {
 public:
  Interrupted() : Error("interrupted") {}
};

/// While one lives, long work that its thread does asks it now and then whether to go on. Of several, one in
/// the other, the innermost is asked. Thread rule: made, asked and gone on one thread.
class Interruption {
 public:
  /// @param asked whether to end, until it says so. Empty: never. @param seldom it is called again after this
  /// time at the earliest.
  explicit Interruption(std::function<bool()> asked,
                        std::chrono::milliseconds seldom = std::chrono::milliseconds(50));
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Whether the work of this thread is to end. Once it is, it stays so.
  [[nodiscard]] static bool is_wanted();
  /// Whether it has been told so. Asks nobody.
  [[nodiscard]] static bool is_over();
  /// For loops: each round some microseconds long or more. @throws Interrupted if the work is to end.
  static void check() {
    if (is_wanted()) throw Interrupted();
  }

 private:
  std::function<bool()> asked_;
  std::chrono::milliseconds seldom_;
  std::chrono::nanoseconds last_{};  // of a clock that rises
  bool is_over_ = false;
  Interruption* outer_;
};

}  // namespace bsp2::geometry
