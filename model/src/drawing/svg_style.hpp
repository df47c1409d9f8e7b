#pragma once

#include <libxml/tree.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace bsp2::model::svg {

/// What the style sheets of a drawing say, as far as its readers ask: rules whose selectors are an element's
/// name, classes, an id, or these together (`rect.cut`, `#a`, `.b.c`, `*`). Others, with elements around or
/// beside, and those of media are passed over.
class StyleSheet {
 public:
  StyleSheet() = default;
  /// All sheets of a document. @param name of its file, for messages.
  StyleSheet(const xmlNode* root, std::string name);

  /// What holds for an element itself, of the properties of visibility, strokes, clips and markers: by its
  /// attribute `style`, the sheets, or an attribute of that name; empty if nothing is said.
  /// @throws bsp2::Error if all that was asked for takes too many steps: a file decides how often which style
  /// is read.
  [[nodiscard]] std::string property(const xmlNode* node, std::string_view key) const;

 private:
  struct Declaration {
    std::string key, value;
    bool is_important = false;
  };
  struct Rule {
    std::string type, id;  // empty: any
    std::vector<std::string> classes;
    int weight = 0;
    std::size_t place = 0;  // in the order of the sheets
    std::vector<Declaration> declarations;
  };
  std::unordered_map<std::string, std::vector<Rule>>
      rules_;  // by what they ask first: "#id", ".class", the name of an element or "*"
  std::size_t count_ = 0;
  std::string name_;
  mutable std::size_t steps_ = 0;  // that all properties took

  void spend(std::size_t steps) const;
  static std::vector<Declaration> declarations_of(std::string_view text);
  void read(std::string text);
  void add(std::string_view selector, const std::vector<Declaration>& declarations);
};

}  // namespace bsp2::model::svg
