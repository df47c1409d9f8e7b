#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "bsp2/geometry/support/suggestion.hpp"

/// What an option or an argument may be. The text of a check follows the option's name in the message.
namespace bsp2::jobs {

/// A number from `least` to `most`, both included; help and messages tell them by the words of `range`.
template <class Number>
CLI::Validator is_number(Number least, Number most, const std::string& range) {
  return {
      [=](const std::string& text) -> std::string {
        Number value{};
        if (CLI::detail::lexical_cast(text, value) && least <= value && value <= most) return {};
        return std::string(std::is_integral_v<Number> ? "must be a whole number, " : "must be a number, ") +
               range + ", not '" + text + "'";
      },
      range};
}

/// One of these words.
inline CLI::Validator is_one_of(std::vector<std::string> words) {
  std::string list, spoken;
  for (const std::string& word : words) {
    list += (list.empty() ? "" : ",") + word;
    spoken += (word == words.front() ? "" : word == words.back() ? " or " : ", ") + word;
  }
  return {[=](const std::string& text) -> std::string {
            if (std::find(words.begin(), words.end(), text) != words.end()) return {};
            return "must be " + spoken + ", not '" + text + "'" +
                   suggestion(text, std::vector<std::string_view>(words.begin(), words.end()));
          },
          "{" + list + "}"};
}

/// A file or a folder. One without a name, as by a variable of a script that is not set, is a mistake.
inline CLI::Validator is_named() {
  return {[](const std::string& text) {
            return text.empty() ? std::string("needs a name, not an empty text") : std::string();
          },
          ""};
}

}  // namespace bsp2::jobs
