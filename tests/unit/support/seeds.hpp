#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <random>

namespace bsp2::samples {

/// Says of which seed an exception was that ends a test: it leaves the scopes of SCOPED_TRACE before it is
/// told.
class SeedTeller : public testing::EmptyTestEventListener {
 public:
  void begins(std::uint64_t seed) { seed_ = seed; }

  void OnTestStart(const testing::TestInfo&) override { seed_.reset(); }
  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (result.failed() && result.file_name() == nullptr && seed_)
      std::cout << "the last seed: BSP2_SEED=" << *seed_ << std::endl;
  }

 private:
  std::optional<std::uint64_t> seed_;
};

/// @return BSP2_SEED of the environment, or another one at every call. Of one thread, within a test.
inline std::uint64_t new_seed() {
  static SeedTeller* const teller = [] {
    auto* made = new SeedTeller;  // which GoogleTest owns
    testing::UnitTest::GetInstance()->listeners().Append(made);
    return made;
  }();
  const char* given = std::getenv("BSP2_SEED");
  const std::uint64_t seed = given != nullptr ? std::strtoull(given, nullptr, 10) : std::random_device{}();
  teller->begins(seed);
  return seed;
}

}  // namespace bsp2::samples
