#pragma once

#include <charconv>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::io {

/// Text of many numbers; doubles in the fewest digits that are read as the same double. Asks now and then
/// whether to go on. @throws Interrupted if not.
class MeshText {
 public:
  MeshText& operator<<(std::string_view text) {
    text_ += text;
    return *this;
  }
  MeshText& operator<<(char c) {
    text_ += c;
    return *this;
  }
  template <typename Number>
  requires std::is_arithmetic_v<Number> MeshText& operator<<(Number number) {
    constexpr std::uint32_t seldom = 1024;
    if (++numbers_ % seldom == 0) geometry::Interruption::check();
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, number).ptr;
    text_.append(digits, static_cast<std::size_t>(end - digits));
    return *this;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  std::uint32_t numbers_ = 0;
};

}  // namespace bsp2::io
