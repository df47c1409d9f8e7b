#include "text/csg_scanner.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <system_error>

namespace bsp2::model {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word(char c) { return is_letter(c) || is_digit(c); }
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

constexpr std::size_t most_values =
    std::numeric_limits<std::uint32_t>::max() / 2;  // of one node, so indices fit

}  // namespace

Scanner::Scanner(std::string_view text) : begin_(text.data()), at_(begin_), end_(begin_ + text.size()) {
  if (text.starts_with("\xEF\xBB\xBF")) at_ += 3;  // a byte order mark
}

void Scanner::skip_more_space() {
  while (at_ != end_) {
    if (is_space(*at_)) {
      ++at_;
    } else if (*at_ == '/' && end_ - at_ > 1 && at_[1] == '/') {
      const void* newline = std::memchr(at_, '\n', static_cast<std::size_t>(end_ - at_));
      at_ = newline ? static_cast<const char*>(newline) + 1 : end_;
    } else if (*at_ == '/' && end_ - at_ > 1 && at_[1] == '*') {
      block_comment();
    } else {
      return;
    }
  }
}

void Scanner::block_comment() {
  const std::string_view rest(at_, static_cast<std::size_t>(end_ - at_));
  const std::size_t close = rest.find("*/", 2);
  if (close == std::string_view::npos) fail("this comment is never closed by */");
  at_ += close + 2;
}

bool Scanner::at_node() const {
  return at_ != end_ && (is_letter(*at_) || std::string_view("!#%*").find(*at_) != std::string_view::npos);
}

std::string Scanner::here() const {
  if (at_ == end_) return "the end of the text";
  if (is_word(*at_) || *at_ == '$') {
    const char* to = at_ + 1;
    while (to != end_ && is_word(*to) && to - at_ < 40) ++to;
    return "'" + std::string(at_, to) + "'";
  }
  const auto byte = static_cast<unsigned char>(*at_);
  if (byte > ' ' && byte < 0x7F) return std::string("'") + *at_ + "'";
  std::array<char, 24> text;
  std::snprintf(text.data(), text.size(), "the byte 0x%02X", byte);
  return text.data();
}

std::string_view Scanner::identifier() {
  const char* from = at_;
  if (at_ != end_ && *at_ == '$') ++at_;
  if (at_ == end_ || !is_word(*at_)) {
    at_ = from;
    return {};
  }
  while (at_ != end_ && is_word(*at_)) ++at_;
  return {from, static_cast<std::size_t>(at_ - from)};
}

void Scanner::arguments(std::vector<Argument>& arguments, std::vector<Value>& tape) {
  arguments.clear();
  tape.clear();
  skip_space();
  if (peek() != '(') fail("expected '(' after the name of a node, found " + here());
  advance();
  for (skip_space(); peek() != ')'; skip_space()) {
    Argument argument{{}, static_cast<std::uint32_t>(tape.size())};
    const char* before = at_;
    if (is_letter(peek()) || peek() == '$') {
      argument.name = identifier();
      skip_space();
      if (peek() == '=') {
        advance();
        skip_space();
      } else {
        argument.name = {};  // a positional true, undef, ...
        at_ = before;
      }
    }
    value(tape);
    arguments.push_back(argument);
    skip_space();
    if (peek() == ',') {
      advance();
    } else if (peek() != ')') {
      fail("expected ',' or ')' in the arguments, found " + here());
    }
  }
  advance();
}

void Scanner::value(std::vector<Value>& tape) {
  open_.clear();
  while (true) {
    skip_space();
    if (peek() == '[') {
      advance();
      if (tape.size() > most_values) fail("too many values in one node");
      open_.push_back(static_cast<std::uint32_t>(tape.size()));
      tape.push_back({Value::vector});
      skip_space();
      if (peek() != ']') continue;
    } else {
      scalar(tape);
      if (!open_.empty()) ++tape[open_.back()].size;
    }
    if (tape.size() > most_values) fail("too many values in one node");
    // After a value: close the vectors that end here, then go on after the comma.
    while (!open_.empty()) {
      skip_space();
      if (peek() == ',') {
        advance();
        skip_space();
        if (peek() != ']') break;
      }
      if (peek() != ']') fail("expected ',' or ']' in a vector, found " + here());
      advance();
      const std::uint32_t closed = open_.back();
      open_.pop_back();
      tape[closed].span = static_cast<std::uint32_t>(tape.size()) - closed;
      if (!open_.empty()) ++tape[open_.back()].size;
    }
    if (open_.empty()) return;
  }
}

void Scanner::scalar(std::vector<Value>& tape) {
  const char c = peek();
  if (is_digit(c) || c == '-' || c == '+' || c == '.') {
    tape.push_back({Value::number, 0, 1, number()});
    return;
  }
  if (c == '"') {
    const char* const from = at_ + 1;
    string();
    Value value{Value::text, static_cast<std::uint32_t>(at_ - 1 - from)};
    value.as_text = from;
    tape.push_back(value);
    return;
  }
  const char* before = at_;
  const std::string_view word = identifier();
  if (word == "true" || word == "false") {
    tape.push_back({Value::boolean, 0, 1, word == "true" ? 1.0 : 0.0});
  } else if (word == "undef") {
    tape.push_back({Value::undefined});
  } else if (word == "inf" || word == "nan") {
    at_ = before;
    tape.push_back({Value::number, 0, 1, number()});
  } else {
    at_ = before;
    if (is_letter(c))
      throw SyntaxError{offset(),
                        "expected a value, found " + here() + "; a .csg file holds numbers, not names", true};
    fail("expected a value, found " + here());
  }
}

/// The usual number has few digits and is an integer divided by a small power of ten: both are exact doubles,
/// so one division rounds correctly (Clinger 1990). All others go the long way.
double Scanner::number() {
  static constexpr double powers[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                      1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const char* from = at_;
  const bool negative = *at_ == '-';
  if (negative || *at_ == '+') ++at_;
  std::uint64_t digits = 0;
  const char* first = at_;
  while (at_ != end_ && is_digit(*at_)) digits = 10 * digits + static_cast<std::uint64_t>(*at_++ - '0');
  std::ptrdiff_t count = at_ - first, fraction = 0;
  if (count > 0 && at_ != end_ && *at_ == '.') {
    const char* point = at_++;
    while (at_ != end_ && is_digit(*at_)) digits = 10 * digits + static_cast<std::uint64_t>(*at_++ - '0');
    fraction = at_ - point - 1;
    count += fraction;
  }
  if (count == 0 || count > 15 || (at_ != end_ && (is_word(*at_) || *at_ == '.'))) {
    at_ = from;
    return slow_number();
  }
  const double magnitude = static_cast<double>(digits) / powers[fraction];
  return negative ? -magnitude : magnitude;
}

double Scanner::slow_number() {
  const char* from = at_;
  const bool negative = *at_ == '-';
  if (negative || *at_ == '+') ++at_;
  double magnitude = 0;
  if (at_ != end_ && is_letter(*at_)) {
    const std::string_view word = identifier();
    if (word == "inf") {
      magnitude = std::numeric_limits<double>::infinity();
    } else if (word == "nan") {
      magnitude = std::numeric_limits<double>::quiet_NaN();
    } else {
      at_ = from;
      fail("expected a number, found " + here() + std::string(word));
    }
    return negative ? -magnitude : magnitude;
  }
  if (at_ == end_ || !(is_digit(*at_) || *at_ == '.')) {
    at_ = from;
    fail("expected a number");
  }
  const auto [to, error] = std::from_chars(at_, end_, magnitude);
  if (error == std::errc::invalid_argument || (to != end_ && (is_word(*to) || *to == '.'))) {
    at_ = from;
    fail("this is not a number");
  }
  // Out of range: strtod tells what is too large (inf) from what is too small (0).
  if (error == std::errc::result_out_of_range) magnitude = std::strtod(std::string(at_, to).c_str(), nullptr);
  at_ = to;
  return negative ? -magnitude : magnitude;
}

void Scanner::string() {
  const char* from = at_++;
  while (at_ != end_ && *at_ != '"') at_ += *at_ == '\\' && end_ - at_ > 1 ? 2 : 1;
  if (at_ == end_) {
    at_ = from;
    fail("this string is never closed by \"");
  }
  ++at_;
}

}  // namespace bsp2::model
