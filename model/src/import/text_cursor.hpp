#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace bsp2::model {

/// The double nearest to what a whole word says, of any magnitude; nothing if it is no number. No locale.
std::optional<double> to_number(std::string_view word);

/// Reads the words of a text file of a mesh and knows their lines.
class TextCursor {
 public:
  /// @param comment begins a comment that ends with its line; 0: there are none.
  TextCursor(std::string_view text, const std::filesystem::path& path, char comment = 0)
      : text_(text), path_(path), comment_(comment) {}

  /// The next word on this line; empty at its end.
  std::string_view word() { return next(false); }
  /// The next word on this line or a later one; empty at the end of the text.
  std::string_view token() { return next(true); }
  /// Passes over the rest of the line. @return false at the end of the text.
  bool end_line();
  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }
  [[nodiscard]] std::size_t offset() const { return at_; }
  [[nodiscard]] std::size_t bytes_left() const { return text_.size() - at_; }

  /// The coordinate in a word: finite, at most 1e100. @throws bsp2::Error
  double coordinate(std::string_view word) const;
  /// The number of things in a word: a decimal integer >= 0. @throws bsp2::Error
  std::size_t count(std::string_view word) const;
  /// @throws bsp2::Error "path:line: text"
  [[noreturn]] void fail(const std::string& text) const;
  /// @throws bsp2::Error "path:line: ...", which tells what was found in place of what was expected.
  [[noreturn]] void fail_at(std::string_view word, const std::string& expected) const;

 private:
  std::string_view next(bool across_lines);

  std::string_view text_;
  const std::filesystem::path& path_;
  char comment_;
  std::size_t at_ = 0, line_ = 1;
};

}  // namespace bsp2::model
