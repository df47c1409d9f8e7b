#include "surfaces/labels.hpp"

#include <algorithm>
#include <cctype>

namespace bsp2::io {
namespace {

/// How many bytes the character has that begins here; 0 if there is none. As the Unicode standard's table 3-7
/// says, without what XML forbids.
std::size_t length_of_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xc2 && lead <= 0xdf ? 2 : lead >= 0xe0 && lead <= 0xef ? 3 : 4;
  if (lead < 0xc2 || lead > 0xf4) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if (byte(i) < 0x80 || byte(i) > 0xbf) return 0;
  if ((lead == 0xe0 && byte(1) < 0xa0) || (lead == 0xed && byte(1) > 0x9f) ||
      (lead == 0xf0 && byte(1) < 0x90) || (lead == 0xf4 && byte(1) > 0x8f))
    return 0;
  if (lead == 0xef && byte(1) == 0xbf && byte(2) >= 0xbe) return 0;
  return length;
}

}  // namespace

std::string one_line(const std::string& name) {
  std::string line;
  for (std::string_view rest = name; !rest.empty();) {
    const std::size_t length = length_of_character(rest);
    if (length == 0)
      line += "\xef\xbf\xbd";
    else if (static_cast<unsigned char>(rest[0]) < ' ' || rest[0] == '\x7f')
      line += ' ';
    else
      line += rest.substr(0, length);
    rest.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return line;
}

bool PartLabels::are_coloured() const {
  return std::any_of(parts_->colours.begin(), parts_->colours.end(),
                     [](const auto& colour) { return colour.has_value(); });
}

std::string PartLabels::name(std::int32_t owner) const {
  if (owner < 0) return std::string(no_part_name);
  const auto part = static_cast<std::size_t>(owner);
  if (part < parts_->names.size()) return one_line(parts_->names[part]);
  return owner == 0 && count() == 0 ? one_line(whole_) : "part_" + std::to_string(owner);
}

std::optional<SurfaceParts::Colour> PartLabels::colour(std::int32_t owner) const {
  const auto part = static_cast<std::size_t>(owner);
  return owner >= 0 && part < parts_->colours.size() ? parts_->colours[part] : std::nullopt;
}

std::string Words::word(const std::string& name, std::int32_t owner) {
  std::string word = one_line(name);
  for (char& c : word) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == ' ' || (kind_ == Kind::identifier && !(byte < 0x80 && std::isalnum(byte) != 0))) c = '_';
  }
  if (kind_ == Kind::identifier && !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) != 0)
    word.insert(word.begin(), '_');
  while (!taken_.insert(word).second) word += "_" + std::to_string(owner);
  return word;
}

std::string hexadecimal(const SurfaceParts::Colour& colour) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text = "#";
  for (const unsigned channel : colour) (text += digits[channel / 16]) += digits[channel % 16];
  return text;
}

}  // namespace bsp2::io
