#include "import/text_cursor.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"

namespace bsp2::model {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

}  // namespace

std::optional<double> to_number(std::string_view word) {
  if (word.starts_with('+') && word.size() > 1 && word[1] != '-') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error == std::errc::invalid_argument || end != word.data() + word.size())
    return std::nullopt;
  if (error == std::errc::result_out_of_range)
    return std::strtod(std::string(word).c_str(), nullptr);  // tells inf from 0
  return value;
}

std::string_view TextCursor::next(bool across_lines) {
  for (; at_ < text_.size(); ++at_) {
    const char c = text_[at_];
    if (comment_ != 0 && c == comment_)
      at_ = std::min(text_.find('\n', at_), text_.size()) - 1;
    else if (c == '\n' && !across_lines)
      return {};
    else if (c == '\n')
      ++line_;
    else if (!is_space(c))
      break;
  }
  const std::size_t from = at_;
  while (at_ < text_.size() && !is_space(text_[at_]) && text_[at_] != '\n' &&
         (comment_ == 0 || text_[at_] != comment_))
    ++at_;
  return text_.substr(from, at_ - from);
}

bool TextCursor::end_line() {
  const std::size_t newline = text_.find('\n', at_);
  if (newline == std::string_view::npos) {
    at_ = text_.size();
    return false;
  }
  at_ = newline + 1;
  ++line_;
  return at_ < text_.size();
}

double TextCursor::coordinate(std::string_view word) const {
  const auto value = to_number(word);
  if (!value) fail_at(word, "a coordinate");
  if (!(std::fabs(*value) <= largest_coordinate))
    fail("the coordinate " + std::string(word.substr(0, 40)) + " is not finite or too large");
  return *value;
}

std::size_t TextCursor::count(std::string_view word) const {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size()) fail_at(word, "a count");
  return value;
}

void TextCursor::fail(const std::string& text) const {
  throw Error(path_.string() + ":" + std::to_string(line_) + ": " + text);
}

void TextCursor::fail_at(std::string_view word, const std::string& expected) const {
  if (word.empty())
    fail("expected " + expected + ", found the end of the " + (at_end() ? "file; it is cut off" : "line"));
  std::string found;
  for (const char c : word.substr(0, 40)) found += c >= ' ' && c < 0x7F ? c : '?';
  fail("expected " + expected + ", found '" + found + "'");
}

}  // namespace bsp2::model
