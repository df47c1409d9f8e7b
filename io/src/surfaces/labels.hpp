#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "bsp2/io/outputs/surface.hpp"

namespace bsp2::io {

/// What no part owns is called like that.
inline constexpr std::string_view no_part_name = "no_part";

/// A name in one line of valid UTF-8: control characters become spaces, bytes that are no text U+FFFD.
std::string one_line(const std::string& name);

/// Names and colours of parts, as files need them.
class PartLabels {
 public:
  /// @param whole what the solid is called where nothing has a name.
  PartLabels(const SurfaceParts& parts, std::string whole) : parts_(&parts), whole_(std::move(whole)) {}

  [[nodiscard]] std::size_t count() const { return parts_->names.size(); }  ///< of names
  [[nodiscard]] bool are_coloured() const;
  /// In one line.
  [[nodiscard]] std::string name(std::int32_t owner) const;
  [[nodiscard]] std::optional<SurfaceParts::Colour> colour(std::int32_t owner) const;
  /// Where each has to have one.
  [[nodiscard]] SurfaceParts::Colour shown_colour(std::int32_t owner) const {
    return colour(owner).value_or(parts_->other_colour);
  }
  [[nodiscard]] const std::string& whole() const { return whole_; }

 private:
  const SurfaceParts* parts_;
  std::string whole_;
};

/// Makes words of names, each another one: of letters, digits and `_`, the first no digit, or of all but
/// spaces.
class Words {
 public:
  enum class Kind { identifier, without_spaces };
  explicit Words(Kind kind) : kind_(kind) {}
  std::string word(const std::string& name, std::int32_t owner);

 private:
  Kind kind_;
  std::set<std::string> taken_{""};
};

/// "#rrggbbaa", in capitals.
std::string hexadecimal(const SurfaceParts::Colour& colour);

}  // namespace bsp2::io
