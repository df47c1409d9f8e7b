#include <array>
#include <charconv>
#include <cmath>

#include "bsp2/bsp2.hpp"

namespace bsp2 {
namespace {

template <typename Number>
void append_number(std::string& text, Number number) {
  // Most numbers of a matrix are 0 or 1.
  if (number >= 0 && number < 10 && !std::signbit(static_cast<double>(number)))
    if (const int digit = static_cast<int>(number); static_cast<Number>(digit) == number) {
      text += static_cast<char>('0' + digit);
      return;
    }
  std::array<char, 32> digits;  // the shortest text that is read as the same number
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

template <typename Number>
void append_list(std::string& text, std::span<const Number> numbers) {
  text += '[';
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) text += ", ";
    append_number(text, numbers[i]);
  }
  text += ']';
}

template <typename Number>
void append_rows(std::string& text, std::span<const Number> numbers, std::size_t width) {
  text.reserve(text.size() + 8 * numbers.size());
  text += '[';
  for (std::size_t i = 0; i + width <= numbers.size() && width > 0; i += width) {
    if (i > 0) text += ", ";
    append_list(text, numbers.subspan(i, width));
  }
  text += ']';
}

bool are_finite(std::span<const double> numbers) {
  for (const double number : numbers)
    if (!std::isfinite(number)) return false;
  return true;
}

}  // namespace

Value::Value(double number) : is_finite_(std::isfinite(number)) { append_number(text_, number); }

Value::Value(std::string_view text) {
  text_.reserve(text.size() + 2);
  text_ += '"';
  for (const char c : text) switch (c) {
      case '"':
      case '\\':
        (text_ += '\\') += c;
        break;
      case '\n':
        text_ += "\\n";
        break;
      case '\t':
        text_ += "\\t";
        break;
      case '\r':
        text_ += "\\r";
        break;
      default:
        text_ += c;
    }
  text_ += '"';
}

Value::Value(std::span<const double> numbers) : is_finite_(are_finite(numbers)) {
  append_list(text_, numbers);
}

void Value::append(const Value& item) {
  if (text_.size() > 1) text_ += ", ";
  text_ += item.text_;
  is_finite_ = is_finite_ && item.is_finite_;
}

Value::Value(std::initializer_list<Value> list) : text_("[") {
  for (const Value& item : list) append(item);
  text_ += ']';
}

Value::Value(const std::vector<Value>& list) : text_("[") {
  for (const Value& item : list) append(item);
  text_ += ']';
}

Value Value::rows(std::span<const double> numbers, std::size_t width) {
  Value value;
  value.is_finite_ = are_finite(numbers);
  append_rows(value.text_, numbers, width);
  return value;
}

Value Value::rows(std::span<const std::uint32_t> numbers, std::size_t width) {
  Value value;
  append_rows(value.text_, numbers, width);
  return value;
}

}  // namespace bsp2
