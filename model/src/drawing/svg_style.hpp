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
/// name, classes, an id, or these together (`rect.cut`, `#a`, `.b.c`, `*`), also within others or directly in
/// them (`g.hidden rect`, `svg > g`). Rules of media are passed over.
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
  /// Whether a style or a sheet, and not an attribute, says something about a property of an element that
  /// readers take from attributes alone: its place or its form. @return the first such one, empty if there is
  /// none.
  [[nodiscard]] std::string property_of_form(const xmlNode* node) const;
  /// Selectors of another kind, before rules that say something.
  [[nodiscard]] const std::vector<std::string>& unread_selectors() const { return unread_; }

 private:
  struct Declaration {
    std::string key, value;
    bool is_important = false;
  };
  struct Compound {
    std::string type, id;  // empty: any
    std::vector<std::string> classes;
    bool is_child = false;  // its parent, not just something around it, is what stands before
  };
  struct Rule {
    std::vector<Compound> path;  // the last one is the element
    int weight = 0;
    std::size_t place = 0;  // in the order of the sheets
    std::vector<Declaration> declarations;
  };
  std::unordered_map<std::string, std::vector<Rule>>
      rules_;  // by what they ask first: "#id", ".class", the name of an element or "*"
  std::size_t count_ = 0;
  std::string name_;
  std::vector<std::string> unread_;
  mutable std::size_t steps_ = 0;  // that all properties took

  void spend(std::size_t steps) const;
  static std::vector<Declaration> declarations_of(std::string_view text);
  void read(std::string text);
  void add(std::string_view selector, const std::vector<Declaration>& declarations);
  static std::optional<Compound> compound_of(std::string_view text, int& weight);
  static std::optional<Rule> rule_of(std::string_view selector);
  [[nodiscard]] bool matches(const xmlNode* node, const std::vector<Compound>& path, std::size_t last) const;
  template <typename Offer>
  void for_each_declaration(const xmlNode* node, Offer offer) const;
};

}  // namespace bsp2::model::svg
