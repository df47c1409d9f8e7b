#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Numbers in messages: the one place that knows of singular and plural. A header alone, since the programs
/// that read files for us link no room.
namespace bsp2 {

/// With commas between thousands: 12,345.
template <std::integral Number>
std::string grouped(Number number) {
  std::string digits = std::to_string(number);
  const std::size_t sign = digits.starts_with('-') ? 1 : 0;
  for (std::size_t at = digits.size(); at > 3 + sign; at -= 3) digits.insert(at - 3, 1, ',');
  return digits;
}

namespace detail {

/// Of "one|many", or of "many" alone.
inline std::string_view form_for(bool is_one, std::string_view forms) {
  const std::size_t bar = forms.find('|');
  if (bar == std::string_view::npos) return is_one ? "" : forms;
  return is_one ? forms.substr(0, bar) : forms.substr(bar + 1);
}

}  // namespace detail

/// A sentence about so many things, in the right grammatical number: '#' in it is the count, "[one|many]" the
/// first form for one and the second for all others, zero too, and "[s]" is "[|s]".
///
/// `counted(n, "# edge[s] [is|are] open")` is "1 edge is open", and "0 edges are open".
///
/// @param sentence is written in the source, where a test finds it and prints it with 0, 1 and 2: names,
/// which may hold such characters, go before or behind it. Any thread.
template <std::integral Count>
std::string counted(Count count, std::string_view sentence) {
  std::string text;
  for (std::size_t at = 0; at < sentence.size(); ++at) {
    if (sentence[at] == '#') {
      text += grouped(count);
    } else if (sentence[at] == '[') {
      const std::size_t end = sentence.find(']', at);
      text += detail::form_for(count == 1, sentence.substr(at + 1, end - at - 1));
      at = end;
    } else {
      text += sentence[at];
    }
  }
  return text;
}

/// "the part 'a'", or "7 parts 'a', 'b', 'c', 'd' and 3 more".
inline std::string parts_named(const std::vector<std::string>& names) {
  constexpr std::size_t most = 4;
  const std::size_t shown = names.size() <= most + 1 ? names.size() : most;  // one more takes no less space
  std::string text = names.size() == 1 ? "the part " : counted(names.size(), "# part[s] ");
  for (std::size_t i = 0; i < shown; ++i) {
    const bool is_last = i + 1 == names.size();
    text += (i == 0 ? "'" : is_last ? " and '" : ", '") + names[i] + "'";
  }
  return shown < names.size() ? text + " and " + grouped(names.size() - shown) + " more" : text;
}

}  // namespace bsp2
