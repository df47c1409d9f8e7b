#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <random>

namespace bsp2::samples {

/// Says of which seed a test was that has failed, if it has one; and the last one of a test that ends by an
/// exception: it leaves the scopes of SCOPED_TRACE before it is told.
class SeedTeller : public testing::EmptyTestEventListener {
 public:
  void begins(std::uint32_t seed) {
    is_one_ = !seed_ || (is_one_ && *seed_ == seed);
    seed_ = seed;
  }

  void OnTestStart(const testing::TestInfo&) override { seed_.reset(); }
  void OnTestEnd(const testing::TestInfo& test) override {
    if (seed_ && is_one_ && test.result()->Failed()) std::cout << "BSP2_SEED=" << *seed_ << std::endl;
  }
  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (result.failed() && result.file_name() == nullptr && seed_)
      std::cout << "the last seed: BSP2_SEED=" << *seed_ << std::endl;
  }

 private:
  std::optional<std::uint32_t> seed_;
  bool is_one_ = true;  // all seeds of the test are one
};

/// @return BSP2_SEED of the environment, or another one at every call. Of one thread, within a test.
inline std::uint32_t new_seed() {
  static SeedTeller* const teller = [] {
    auto* made = new SeedTeller;  // which GoogleTest owns
    testing::UnitTest::GetInstance()->listeners().Append(made);
    return made;
  }();
  const char* given = std::getenv("BSP2_SEED");
  const auto seed = given != nullptr ? static_cast<std::uint32_t>(std::strtoul(given, nullptr, 10))
                                     : std::random_device{}();
  teller->begins(seed);
  return seed;
}

}  // namespace bsp2::samples
