#pragma once

#include <array>
#include <charconv>
#include <concepts>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace bsp2::io {

/// A text that grows: what a stream does, many times as fast. Numbers have as many digits as it takes to read
/// them back.
class Text {
 public:
  explicit Text(std::size_t expected_size = 0) { text_.reserve(expected_size); }

  Text& operator<<(std::string_view words) {
    text_ += words;
    return *this;
  }
  Text& operator<<(char c) {
    text_ += c;
    return *this;
  }
  template <typename Number>
  requires(std::integral<Number> || std::floating_point<Number>) &&
      (!std::same_as<Number, char>)Text& operator<<(Number number) {
    std::array<char, 32> digits;
    const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    text_.append(digits.data(), static_cast<std::size_t>(end - digits.data()));
    return *this;
  }
  /// Numbers with something between them.
  template <typename Numbers>
  Text& list(const Numbers& numbers, std::string_view between) {
    std::string_view before;
    for (const auto number : numbers) {
      *this << before << number;
      before = between;
    }
    return *this;
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// Bytes of a number, as they lie in memory. Room for them has been made. @return where the next ones go.
template <typename T>
char* put(char* to, const T& value) {
  std::memcpy(to, &value, sizeof value);
  return to + sizeof value;
}

}  // namespace bsp2::io
