#pragma once

#include <charconv>
#include <cstring>
#include <string>
#include <string_view>

namespace bsp2::io {

/// Text of many numbers; doubles in the fewest digits that are read as the same double.
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
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, number).ptr;
    text_.append(digits, static_cast<std::size_t>(end - digits));
    return *this;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace bsp2::io
