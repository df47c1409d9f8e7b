#include <cctype>
#include <optional>
#include <string>
#include <string_view>

#include "expression/node.hpp"

namespace bsp2 {
namespace {

bool is_letter(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$'; }

/// Goes through a text of the language that has been read without an error.
class Passage {
 public:
  explicit Passage(std::string_view text, std::size_t at = 0) : text_(text), at_(at) {}
  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
  [[nodiscard]] char peek() const { return at_end() ? '\0' : text_[at_]; }
  [[nodiscard]] std::size_t offset() const { return at_; }
  void advance() { ++at_; }
  /// White space and comments.
  void skip_space() {
    for (;;) {
      if (!at_end() && std::isspace(static_cast<unsigned char>(peek())) != 0) {
        ++at_;
      } else if (text_.substr(at_).starts_with("//")) {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (text_.substr(at_).starts_with("/*")) {
        const std::size_t end = text_.find("*/", at_ + 2);
        at_ = end == std::string_view::npos ? text_.size() : end + 2;
      } else {
        return;
      }
    }
  }
  std::string_view word() {
    const std::size_t begin = at_;
    while (!at_end() && is_letter(peek())) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  /// A string with its quotes.
  std::string_view string() {
    const std::size_t begin = at_++;
    while (!at_end() && peek() != '"') at_ += peek() == '\\' ? 2 : 1;
    at_ = std::min(at_ + 1, text_.size());
    return text_.substr(begin, at_ - begin);
  }
  /// Passes over a string, a word, or another letter.
  void step() {
    if (peek() == '"')
      string();
    else if (is_letter(peek()))
      word();
    else
      advance();
  }
  /// Passes over the node that begins here, with all its operands.
  void node() {
    int depth = 0;
    for (skip_space(); !at_end(); skip_space()) {
      const char c = peek();
      step();
      if (c == '(' || c == '[' || c == '{') ++depth;
      if (c == ')' || c == ']' || c == '}') --depth;
      if (depth == 0 && (c == '}' || c == ';')) return;
    }
  }

 private:
  std::string_view text_;
  std::size_t at_;
};

/// The node that is tagged as the root, without the tag.
std::optional<std::string_view> root_of(std::string_view text) {
  Passage passage(text);
  for (passage.skip_space(); !passage.at_end(); passage.skip_space()) {
    if (passage.peek() == '*') {
      passage.node();  // disabled: nothing in it counts
    } else if (passage.peek() == '!') {
      passage.advance();
      const std::size_t begin = passage.offset();
      passage.node();
      return text.substr(begin, passage.offset() - begin);
    } else {
      passage.step();
    }
  }
  return std::nullopt;
}

/// A string's letters, if it is a relative path.
std::optional<std::string> relative_path(std::string_view quoted) {
  std::string path;
  for (std::size_t i = 1; i + 1 < quoted.size(); ++i) {
    if (quoted[i] == '\\' && i + 2 < quoted.size()) ++i;
    path += quoted[i];
  }
  if (path.empty() || path.front() == '/') return std::nullopt;
  return path;
}

}  // namespace

std::filesystem::path absolute_path(const std::filesystem::path& path) {
  if (path.empty()) throw Error("a file is needed, and no name is given");
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  if (error) throw Error("cannot tell where '" + path.string() + "' is: " + error.message());
  return absolute.lexically_normal();
}

std::string embedded(std::string_view text, const std::filesystem::path& folder) {
  const std::optional<std::string_view> root = root_of(text);
  if (root) text = *root;
  std::string result;
  result.reserve(text.size() + 64);
  Passage passage(text);
  std::size_t copied = 0;
  const auto copy = [&](std::size_t end) { result.append(text.substr(copied, end - copied)), copied = end; };
  std::string_view node, word;
  bool names_file = false;  // a string here names a file
  for (passage.skip_space(); !passage.at_end(); passage.skip_space()) {
    const char c = passage.peek();
    const std::size_t begin = passage.offset();
    if (c == '"') {
      const std::string_view quoted = passage.string();
      if (const auto path = names_file ? relative_path(quoted) : std::nullopt) {
        copy(begin);
        result += Value((folder / *path).lexically_normal().string()).text();
        copied = passage.offset();
      }
      names_file = false;
    } else if (is_letter(c)) {
      word = passage.word();
      names_file = false;
    } else {
      if (c == '!' && root) {  // only the first one counts
        copy(begin);
        ++copied;
      }
      if (c == '(') node = word;
      names_file = c == '(' ? node == "import" || node == "surface" : c == '=' && word == "file";
      passage.advance();
    }
  }
  copy(text.size());
  return result;
}

}  // namespace bsp2
