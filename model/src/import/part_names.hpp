#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>

/// What parts of files are called. Headers only: programs that read files for the model have it, too.
namespace bsp2::model {

/// How many bytes the UTF-8 character at the beginning has; 0 if it is none.
inline std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0) != 0x80) return 0;
  if (first == 0xE0 && byte(1) < 0xA0) return 0;   // could be shorter
  if (first == 0xED && byte(1) >= 0xA0) return 0;  // half a character of UTF-16
  if ((first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) >= 0x90)) return 0;
  return length;
}

/// A name as a file has it, as one that can be written anywhere: UTF-8 in one line, of at most 200 bytes.
inline std::string printable_name(std::string_view text) {
  constexpr std::size_t most_bytes = 200;
  std::string name;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const bool is_control = length == 1 && (static_cast<unsigned char>(text[0]) < ' ' || text[0] == 0x7F);
    if (name.size() + (length == 0 ? 1 : length) > most_bytes) break;
    name += length == 0 ? "?" : is_control ? " " : text.substr(0, length);
    text.remove_prefix(length == 0 ? 1 : length);
  }
  const std::size_t first = name.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  return name.substr(first, name.find_last_not_of(' ') + 1 - first);
}

/// Names, each once: in a model one name is one part, in files it may be the name of many.
class PartNames {
 public:
  /// The name, or "name (2)", ... where it is there already. One that is empty stays so.
  std::string once(const std::string& wanted) {
    if (wanted.empty()) return wanted;
    std::size_t& times = times_[wanted];
    std::string name = wanted;
    while (++times > 1) {
      name = wanted + " (" + std::to_string(times) + ")";
      if (times_.try_emplace(name, 1).second) break;
    }
    return name;
  }

 private:
  std::unordered_map<std::string, std::size_t> times_;  // elements keep their place
};

}  // namespace bsp2::model
