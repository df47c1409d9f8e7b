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
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) continue;
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

void StyleSheet::add(std::string_view selector, const std::vector<Declaration>& declarations) {
  constexpr int weight_of_id = 10'000, weight_of_class = 100;
  Rule rule;
  std::string key = "*";
  const std::size_t parts = std::min(selector.find_first_of(".#"), selector.size());
  if (const std::string_view type = selector.substr(0, parts); is_name(type)) {
    key = rule.type = type;
    rule.weight = 1;
  } else if (type != "*" && !(type.empty() && parts < selector.size())) {
    return;
  }
  for (std::size_t at = parts; at < selector.size();) {
    const std::size_t end = std::min(selector.find_first_of(".#", at + 1), selector.size());
    const std::string_view name = selector.substr(at + 1, end - at - 1);
    if (!is_name(name)) return;
    if (selector[at] == '#') {
      if (!rule.id.empty() && rule.id != name) return;
      rule.id = name;
    } else {
      rule.classes.emplace_back(name);
    }
    rule.weight += selector[at] == '#' ? weight_of_id : weight_of_class;
    at = end;
  }
  if (!rule.id.empty())
    key = "#" + rule.id;
  else if (!rule.classes.empty())
    key = "." + rule.classes[0];
  if (count_ == most_rules || declarations.empty()) return;
  rule.place = count_++;
  rule.declarations = declarations;
  rules_[key].push_back(std::move(rule));
}

std::string StyleSheet::property(const xmlNode* node, std::string_view key) const {
  std::string value = attribute(node, std::string(key).c_str());
  std::array<std::size_t, 3> best{};  // whether it is important, its weight, its place
  const auto offer = [&](const std::vector<Declaration>& declarations, std::size_t weight,
                         std::size_t place) {
    for (const Declaration& each : declarations) {
      const std::array<std::size_t, 3> rank{each.is_important ? 1U : 0U, weight, place + 1};
      if (each.key != key || rank < best) continue;
      best = rank;
      value = each.value;
    }
  };
  if (!rules_.empty()) {
    const std::string type = reinterpret_cast<const char*>(node->name), id = attribute(node, "id");
    const std::vector<std::string> classes = words_of(attribute(node, "class"));
    const auto offer_all = [&](const std::string& name) {
      const auto found = rules_.find(name);
      if (found == rules_.end()) return;
      spend(found->second.size() * (1 + classes.size()));
      for (const Rule& rule : found->second) {
        const bool has_classes =
            std::all_of(rule.classes.begin(), rule.classes.end(), [&](const std::string& each) {
              return std::find(classes.begin(), classes.end(), each) != classes.end();
            });
        if (has_classes && (rule.type.empty() || rule.type == type) && (rule.id.empty() || rule.id == id))
          offer(rule.declarations, static_cast<std::size_t>(rule.weight), rule.place);
      }
    };
    offer_all("*");
    offer_all(type);
    if (!id.empty()) offer_all("#" + id);
    for (const std::string& each : classes) offer_all("." + each);
  }
  constexpr std::size_t weight_of_style = 1'000'000'000;
  if (const std::string style = attribute(node, "style"); !style.empty()) {
    constexpr std::size_t letters_in_step = 8;
    spend(style.size() / letters_in_step);
    offer(declarations_of(style), weight_of_style, 0);
  }
  return value;
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
