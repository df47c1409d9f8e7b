#include "drawing/svg_style.hpp"

#include <algorithm>
#include <memory>

#include "bsp2/geometry/support/error.hpp"
#include "drawing/svg_shapes.hpp"

namespace bsp2::model::svg {
namespace {

constexpr std::string_view space = " \t\r\n\f";
constexpr std::size_t most_rules = 10'000;
constexpr std::array<std::string_view, 11> keys{
    "display",    "visibility", "clip-path",    "mask",           "marker",         "marker-start",
    "marker-mid", "marker-end", "stroke-width", "stroke-linecap", "stroke-linejoin"};
/// Attributes in drawings of old, and properties as well since SVG 2.
constexpr std::array<std::string_view, 12> keys_of_form{
    "transform", "transform-origin", "d", "x", "y", "width", "height", "r", "cx", "cy", "rx", "ry"};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(space);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(space) + 1 - first);
}

bool is_name(std::string_view text) {
  return !text.empty() && text.find_first_of(" \t\r\n\f.#:>+~[]()*,\"'") == std::string_view::npos;
}

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  for (std::size_t at = text.find_first_not_of(space); at < text.size();
       at = text.find_first_not_of(space, at)) {
    const std::size_t end = std::min(text.find_first_of(space, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

}  // namespace

StyleSheet::StyleSheet(const xmlNode* root, std::string name) : name_(std::move(name)) {
  std::vector<const xmlNode*> stack{root};
  while (!stack.empty()) {
    const xmlNode* node = stack.back();
    stack.pop_back();
    if (xmlStrEqual(node->name, reinterpret_cast<const xmlChar*>("style"))) {
      const std::unique_ptr<xmlChar, void (*)(void*)> text(xmlNodeGetContent(node),
                                                           [](void* p) { xmlFree(p); });
      if (text) read(reinterpret_cast<const char*>(text.get()));
    }
    for (const xmlNode* child = node->last; child != nullptr; child = child->prev)
      if (child->type == XML_ELEMENT_NODE) stack.push_back(child);
  }
}

/// Of the properties that anybody asks for, so that what is kept is small; the last of several with the same
/// name.
std::vector<StyleSheet::Declaration> StyleSheet::declarations_of(std::string_view text) {
  constexpr std::string_view important = "!important";
  std::vector<Declaration> declarations;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(';', at), text.size());
    const std::string_view one = text.substr(at, end - at);
    at = end + 1;
    const std::size_t colon = one.find(':');
    if (colon == std::string_view::npos) continue;
    std::string_view value = trimmed(one.substr(colon + 1));
    const bool is_important = value.ends_with(important);
    if (is_important) value = trimmed(value.substr(0, value.size() - important.size()));
    const std::string_view key = trimmed(one.substr(0, colon));
    if (std::find(keys.begin(), keys.end(), key) == keys.end() &&
        std::find(keys_of_form.begin(), keys_of_form.end(), key) == keys_of_form.end())
      continue;
    const auto known = std::find_if(declarations.begin(), declarations.end(),
                                    [&](const Declaration& each) { return each.key == key; });
    if (known == declarations.end())
      declarations.push_back({std::string(key), std::string(value), is_important});
    else if (is_important || !known->is_important)
      *known = {std::string(key), std::string(value), is_important};
  }
  return declarations;
}

void StyleSheet::read(std::string text) {
  for (std::size_t at = 0; (at = text.find("/*", at)) != std::string::npos;) {
    const std::size_t end = text.find("*/", at + 2);
    std::fill(text.begin() + static_cast<std::ptrdiff_t>(at),
              end == std::string::npos ? text.end() : text.begin() + static_cast<std::ptrdiff_t>(end) + 2,
              ' ');
    if (end == std::string::npos) break;
  }
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = text.find_first_of("{;", at);
    if (open == std::string::npos) return;
    if (text[open] == ';') {  // of @charset or @import
      at = open + 1;
      continue;
    }
    const std::string_view selectors = trimmed(std::string_view(text).substr(at, open - at));
    std::size_t close = open + 1;
    for (int depth = 1; close < text.size(); ++close) {
      depth += text[close] == '{' ? 1 : text[close] == '}' ? -1 : 0;
      if (depth == 0) break;
    }
    at = close + 1;
    if (selectors.starts_with('@')) continue;
    const auto declarations = declarations_of(std::string_view(text).substr(open + 1, close - open - 1));
    for (std::size_t from = 0; from < selectors.size();) {
      const std::size_t comma = std::min(selectors.find(',', from), selectors.size());
      add(trimmed(selectors.substr(from, comma - from)), declarations);
      from = comma + 1;
    }
  }
}

/// `rect.cut#a`, or `*`. @param weight gets what it adds. @return none if it is of another kind.
std::optional<StyleSheet::Compound> StyleSheet::compound_of(std::string_view text, int& weight) {
  constexpr int weight_of_id = 10'000, weight_of_class = 100;
  Compound compound;
  const std::size_t parts = std::min(text.find_first_of(".#"), text.size());
  if (const std::string_view type = text.substr(0, parts); is_name(type)) {
    compound.type = type;
    weight += 1;
  } else if (type != "*" && !(type.empty() && parts < text.size())) {
    return std::nullopt;
  }
  for (std::size_t at = parts; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of(".#", at + 1), text.size());
    const std::string_view name = text.substr(at + 1, end - at - 1);
    if (!is_name(name)) return std::nullopt;
    if (text[at] == '#') {
      if (!compound.id.empty() && compound.id != name) return std::nullopt;
      compound.id = name;
    } else {
      compound.classes.emplace_back(name);
    }
    weight += text[at] == '#' ? weight_of_id : weight_of_class;
    at = end;
  }
  return compound;
}

/// @return none if it is of another kind.
std::optional<StyleSheet::Rule> StyleSheet::rule_of(std::string_view selector) {
  constexpr std::size_t longest_path = 32;
  Rule rule;
  bool is_child = false;
  for (std::size_t at = 0; at < selector.size();) {
    if (space.find(selector[at]) != std::string_view::npos) {
      ++at;
    } else if (selector[at] == '>') {
      if (is_child || rule.path.empty()) return std::nullopt;
      is_child = true;
      ++at;
    } else {
      const std::size_t end = std::min(selector.find_first_of(" \t\r\n\f>", at), selector.size());
      auto compound = compound_of(selector.substr(at, end - at), rule.weight);
      if (!compound || rule.path.size() == longest_path) return std::nullopt;
      compound->is_child = std::exchange(is_child, false);
      rule.path.push_back(std::move(*compound));
      at = end;
    }
  }
  if (rule.path.empty() || is_child) return std::nullopt;
  return rule;
}

void StyleSheet::add(std::string_view selector, const std::vector<Declaration>& declarations) {
  if (declarations.empty()) return;
  std::optional<Rule> rule = rule_of(selector);
  if (!rule) {
    // What holds while a mouse is over something is not drawn.
    constexpr std::array<std::string_view, 4> passing{":hover", ":active", ":focus", ":visited"};
    if (std::none_of(passing.begin(), passing.end(),
                     [&](std::string_view each) { return selector.find(each) != std::string_view::npos; }))
      unread_.emplace_back(selector);
    return;
  }
  if (count_ == most_rules) return;
  const Compound& element = rule->path.back();
  const std::string key = !element.id.empty()        ? "#" + element.id
                          : !element.classes.empty() ? "." + element.classes[0]
                          : !element.type.empty()    ? element.type
                                                     : "*";
  rule->place = count_++;
  rule->declarations = declarations;
  rules_[key].push_back(std::move(*rule));
}

bool StyleSheet::matches(const xmlNode* node, const std::vector<Compound>& path, std::size_t last) const {
  const Compound& compound = path[last];
  spend(1 + compound.classes.size());
  if (node->type != XML_ELEMENT_NODE) return false;
  if (!compound.type.empty() && compound.type != reinterpret_cast<const char*>(node->name)) return false;
  if (!compound.id.empty() && compound.id != attribute(node, "id")) return false;
  if (!compound.classes.empty()) {
    const std::vector<std::string> classes = words_of(attribute(node, "class"));
    if (!std::all_of(compound.classes.begin(), compound.classes.end(), [&](const std::string& each) {
          return std::find(classes.begin(), classes.end(), each) != classes.end();
        }))
      return false;
  }
  if (last == 0) return true;
  for (const xmlNode* around = node->parent; around != nullptr; around = around->parent) {
    if (matches(around, path, last - 1)) return true;
    if (compound.is_child) return false;
  }
  return false;
}

/// Calls offer(declaration, weight, place) with all that holds for an element but its attributes of the same
/// name.
template <typename Offer>
void StyleSheet::for_each_declaration(const xmlNode* node, Offer offer) const {
  if (!rules_.empty()) {
    const auto offer_all = [&](const std::string& name) {
      const auto found = rules_.find(name);
      if (found == rules_.end()) return;
      for (const Rule& rule : found->second)
        if (matches(node, rule.path, rule.path.size() - 1))
          for (const Declaration& each : rule.declarations)
            offer(each, static_cast<std::size_t>(rule.weight), rule.place);
    };
    offer_all("*");
    offer_all(reinterpret_cast<const char*>(node->name));
    if (const std::string id = attribute(node, "id"); !id.empty()) offer_all("#" + id);
    for (const std::string& each : words_of(attribute(node, "class"))) offer_all("." + each);
  }
  constexpr std::size_t weight_of_style = 1'000'000'000;
  if (const std::string style = attribute(node, "style"); !style.empty()) {
    constexpr std::size_t letters_in_step = 8;
    spend(style.size() / letters_in_step);
    for (const Declaration& each : declarations_of(style)) offer(each, weight_of_style, 0);
  }
}

std::string StyleSheet::property(const xmlNode* node, std::string_view key) const {
  std::string value = attribute(node, std::string(key).c_str());
  std::array<std::size_t, 3> best{};  // whether it is important, its weight, its place
  for_each_declaration(node, [&](const Declaration& each, std::size_t weight, std::size_t place) {
    const std::array<std::size_t, 3> rank{each.is_important ? 1U : 0U, weight, place + 1};
    if (each.key != key || rank < best) return;
    best = rank;
    value = each.value;
  });
  return value;
}

std::string StyleSheet::property_of_form(const xmlNode* node) const {
  std::string found;
  for_each_declaration(node, [&](const Declaration& each, std::size_t, std::size_t) {
    const auto is_that = [&](std::string_view key) { return each.key == key; };
    if (found.empty() && each.value != "none" && each.value != "auto" &&
        std::any_of(keys_of_form.begin(), keys_of_form.end(), is_that))
      found = each.key;
  });
  return found;
}

void StyleSheet::spend(std::size_t steps) const {
  constexpr std::size_t most_steps = 100'000'000;
  steps_ += steps;
  if (steps_ > most_steps)
    throw Error(
        "import: " + name_ +
        ": its elements have styles, and rules of style sheets that may be theirs, which take more than " +
        std::to_string(most_steps) + " steps to read");
}

}  // namespace bsp2::model::svg
