#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace bsp2::model {

/// Turns byte offsets of a text into "line:column" (from 1, columns in UTF-8 characters), in any order: it
/// looks at the text up to the farthest offset once, and at a few thousand bytes again for each.
///
/// Not for several threads at once: it remembers what it has looked at. The text has to outlive it.
class LineFinder {
 public:
  explicit LineFinder(std::string_view text) : text_(text), marks_(1) {}
  /// @param offset at most the size of the text.
  std::string at(std::size_t offset);

 private:
  /// What is known of a byte.
  struct Mark {
    std::size_t line = 1, column = 1;
  };
  [[nodiscard]] Mark walk(Mark mark, std::size_t begin, std::size_t end) const;

  std::string_view text_;
  std::vector<Mark> marks_;  ///< of the first byte of each block
};

}  // namespace bsp2::model
