#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace bsp2::model {

/// A syntax error at a byte of the text; the reader turns it into a bsp2::Error with line and column.
struct SyntaxError {
  std::size_t offset;
  std::string text;
  bool is_source = false;  ///< what stands there is a name: OpenSCAD's own language has those
};

/// One value of an argument. Values are kept in a flat list ("tape"): a vector is followed by its elements.
struct Value {
  enum Kind : std::uint8_t { undefined, number, boolean, text, vector };
  Kind kind = undefined;
  std::uint32_t size = 0;  ///< elements of a vector, bytes of a string
  std::uint32_t span = 1;  ///< values on the tape, this one and all below it
  union {
    double as_number = 0;  ///< of a number; 0 or 1 of a boolean
    const char* as_text;   ///< of a string: what stands between the quotes, in the text itself
  };
};

struct Argument {
  std::string_view name;  ///< empty if positional
  std::uint32_t value;    ///< index on the tape
};

/// Reads the tokens and values of a .csg text.
///
/// No recursion: a vector may be nested as deeply as it likes. Numbers are C doubles, read to the nearest
/// double; inf and nan are numbers, as OpenSCAD writes them.
class Scanner {
 public:
  explicit Scanner(std::string_view text);

  /// Skips white space and comments. Most often there is none or one space: this is asked for several times a
  /// number.
  void skip_space() {
    if (at_ != end_ && *at_ == ' ') ++at_;
    if (at_ != end_ && (static_cast<unsigned char>(*at_) <= ' ' || *at_ == '/')) skip_more_space();
  }
  [[nodiscard]] bool at_end() const { return at_ == end_; }
  [[nodiscard]] char peek() const { return at_ == end_ ? '\0' : *at_; }
  [[nodiscard]] std::size_t offset() const { return static_cast<std::size_t>(at_ - begin_); }
  void advance(std::size_t bytes = 1) { at_ += bytes; }
  /// The identifier here, with a leading `$` if there is one; empty if there is none.
  std::string_view identifier();
  /// Reads "( arguments )" into `arguments` and `tape`.
  void arguments(std::vector<Argument>& arguments, std::vector<Value>& tape);
  /// Whether a node begins here: a name or a modifier.
  [[nodiscard]] bool at_node() const;
  /// What stands here, for messages: a name, a character, or the end of the text.
  [[nodiscard]] std::string here() const;
  [[noreturn]] void fail(std::string text) const { throw SyntaxError{offset(), std::move(text)}; }

 private:
  void value(std::vector<Value>& tape);
  void scalar(std::vector<Value>& tape);
  double number();
  double slow_number();
  void string();
  void block_comment();
  void skip_more_space();

  const char *begin_, *at_, *end_;
  std::vector<std::uint32_t> open_;  // vectors that are being read
};

}  // namespace bsp2::model
