#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "bsp2/geometry/exact/exact.hpp"

namespace bsp2::geometry {

/// Hyperplanes that another room computes when asked for, each under a number: the same whenever and wherever
/// it is asked. Thread rule: any number of threads may ask at once.
template <int D>
class ComputedFamily {
 public:
  ComputedFamily() = default;
  ComputedFamily(const ComputedFamily&) = delete;
  ComputedFamily& operator=(const ComputedFamily&) = delete;
  virtual ~ComputedFamily() = default;
  [[nodiscard]] virtual std::uint32_t count() const = 0;
  /// In the family's frame, inside negative: D entries of the normal, then the offset.
  [[nodiscard]] virtual std::array<std::int64_t, D + 1> covector(std::uint32_t number) const = 0;
};

/// A shared ComputedFamily, as a family of the hyperplane table.
template <int D>
class SharedFamily {
 public:
  explicit SharedFamily(std::shared_ptr<const ComputedFamily<D>> family) : family_(std::move(family)) {}
  [[nodiscard]] std::uint32_t count() const { return family_->count(); }
  [[nodiscard]] std::array<LocalInteger, D + 1> exact(std::uint32_t number) const {
    return converted<LocalInteger>(number);
  }
  [[nodiscard]] std::array<long double, D + 1> rounded(std::uint32_t number) const {
    return converted<long double>(number);
  }

 private:
  std::shared_ptr<const ComputedFamily<D>> family_;  // shared: its producer has it too
  template <typename Number>
  [[nodiscard]] std::array<Number, D + 1> converted(std::uint32_t number) const {
    const auto coefficients = family_->covector(number);
    std::array<Number, D + 1> covector{};
    for (std::size_t i = 0; i <= D; ++i) covector[i] = static_cast<Number>(coefficients[i]);
    return covector;
  }
};

}  // namespace bsp2::geometry
