#include "bsp2/api/products/group_rule.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/suggestion.hpp"
#include "bsp2/model/expression/colour.hpp"

namespace bsp2::api {
namespace {

using meshing::GroupRule;
using Sign = GroupRule::Condition::Sign;
using Bound = GroupRule::Condition::Bound;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_space(char c) { return c == ' ' || c == '\t'; }

class PredicateReader {
 public:
  PredicateReader(std::string_view text, std::size_t from, GroupRule& rule)
      : text_(text), at_(from), rule_(rule) {}

  void read() {
    do read_condition();
    while (take("&"));
    if (!rest().empty()) fail("& or the end");
  }

 private:
  const std::string_view text_;
  std::size_t at_;
  GroupRule& rule_;

  /// From the next character that is no space.
  std::string_view rest() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
    return text_.substr(at_);
  }
  bool take(std::string_view token) {
    const bool is_next = rest().starts_with(token);
    if (is_next) at_ += token.size();
    return is_next;
  }
  std::string_view word() {
    const std::string_view left = rest();
    return left.substr(
        0, static_cast<std::size_t>(std::find_if_not(left.begin(), left.end(), is_letter) - left.begin()));
  }

  [[noreturn]] void fail_with(const std::string& what) const {
    throw Error("--group: '" + std::string(text_) + "', character " + std::to_string(at_ + 1) + ": " + what);
  }
  [[noreturn]] void fail(const std::string& expected) {
    const std::string_view found = rest();
    fail_with("expected " + expected + ", found " +
              (found.empty() ? "the end" : "'" + std::string(found.substr(0, 20)) + "'"));
  }

  void read_condition() {
    if (const std::string_view first = word(); first == "colour" || first == "color") {
      at_ += first.size();
      read_colour();
    } else if (first == "angle") {
      at_ += first.size();
      read_angle();
    } else {
      read_half_space();
    }
  }

  void read_colour() {
    if (!take("==")) fail("==");
    const std::string_view left = rest(), name = left.substr(0, left.find_first_of(" \t&"));
    if (name.empty()) fail("a colour");
    const auto colour = model::colour_named(name);
    if (!colour)
      fail_with("'" + std::string(name) + "' is no colour: write a name of CSS or #rrggbb" +
                suggestion(name, model::colour_names()));
    at_ += name.size();
    auto& bytes = rule_.colours.emplace_back();
    for (std::size_t i = 0; i < bytes.size(); ++i)
      bytes[i] = static_cast<std::uint8_t>(std::lround(255 * (*colour)[i]));
  }

  void read_angle() {
    if (!take("<=")) fail("<=");
    const std::size_t first = at_;
    rule_.angle = number();
    if (*rule_.angle >= 0 && *rule_.angle <= 180) return;
    at_ = first;
    fail("an angle of 0 to 180 degrees");
  }

  void read_half_space() {
    GroupRule::Condition condition;
    const std::size_t first = text_.size() - rest().size();
    double sign = take("-") ? -1 : 1;
    add_term(sign, condition.normal);
    while ((sign = take("+") ? 1 : take("-") ? -1 : 0) != 0) add_term(sign, condition.normal);
    if (condition.normal == meshing::Point{}) {
      at_ = first;
      fail_with("the factors of x, y and z are all 0");
    }
    condition.sign = comparison();
    condition.bound = take("min") ? Bound::least : take("max") ? Bound::most : Bound::given;
    if (condition.bound == Bound::given) condition.value = number();
    rule_.conditions.push_back(condition);
  }

  /// `x`, `2*x`, `2 x`.
  void add_term(double sign, meshing::Point& normal) {
    double factor = 1;
    if (word().empty()) {
      if (!starts_number()) fail("x, y, z, colour or angle");
      factor = number();
      take("*");
    }
    const std::string_view axis = word();
    if (axis.empty()) fail("x, y or z");
    if (axis.size() != 1 || axis[0] < 'x' || axis[0] > 'z') fail_at_word(axis);
    normal[static_cast<std::size_t>(axis[0] - 'x')] += sign * factor;
    ++at_;
  }

  [[noreturn]] void fail_at_word(std::string_view word) const {
    static constexpr std::array<std::string_view, 5> known{"x", "y", "z", "colour", "angle"};
    fail_with("'" + std::string(word) + "' is none of x, y, z, colour and angle" + suggestion(word, known));
  }

  Sign comparison() {
    if (take("==")) return Sign::equal;
    if (take("<=")) return Sign::at_most;
    if (take(">=")) return Sign::at_least;
    fail("==, <= or >=");
  }

  bool starts_number() {
    const std::string_view left = rest();
    return !left.empty() && (left[0] == '.' || (left[0] >= '0' && left[0] <= '9'));
  }
  double number() {
    const double sign = take("-") ? -1 : 1;
    double value = 0;
    if (!starts_number()) fail("a number");
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc()) fail("a number that is not too large or small");
    at_ = static_cast<std::size_t>(end - text_.data());
    return sign * value;
  }
};

}  // namespace

GroupRule parse_group(const std::string& text) {
  const auto equal = text.find('=');
  GroupRule rule;
  if (equal != std::string::npos) rule.name = text.substr(0, equal);
  while (rule.name.ends_with(' ')) rule.name.pop_back();
  if (rule.name.empty()) throw Error("--group: '" + text + "' must be NAME=WHERE, for example left=x==min");
  PredicateReader(text, equal + 1, rule).read();
  return rule;
}

}  // namespace bsp2::api
