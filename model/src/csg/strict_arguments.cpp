#include "csg/strict_arguments.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "builder/node_pool.hpp"

namespace bsp2::model {
namespace {

std::string quoted(std::string_view name) { return "'" + std::string(name) + "'"; }

std::optional<std::vector<double>> list_of(const Value& value) {
  if (value.kind != Value::vector || value.span != value.size + 1) return std::nullopt;
  std::vector<double> list;
  for (const Value* at = &value + 1; at != &value + value.span; ++at) {
    if (at->kind != Value::number || !std::isfinite(at->as_number)) return std::nullopt;
    list.push_back(at->as_number);
  }
  return list;
}

}  // namespace

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    words.push_back(text.substr(0, text.find(' ')));
    text.remove_prefix(std::min(words.back().size() + 1, text.size()));
  }
  return words;
}

StrictArguments::StrictArguments(std::string_view node, std::string_view names, const Arguments& arguments)
    : node_(node), names_(words_of(names)), arguments_(arguments) {
  std::size_t positional = 0;
  for (const Argument& argument : arguments.all()) {
    if (argument.name.empty()) {
      if (++positional > names_.size())
        fail("takes at most " + counted(names_.size(), "# argument[s]") + known());
      continue;
    }
    if (std::find(names_.begin(), names_.end(), argument.name) == names_.end())
      fail("has no argument '" + std::string(argument.name.substr(0, 60)) + "'" + known());
  }
}

const Value* StrictArguments::find(std::string_view name) const {
  const auto place = std::find(names_.begin(), names_.end(), name) - names_.begin();
  return arguments_.find(name, static_cast<int>(place));
}

const Value& StrictArguments::needed(std::string_view name) const {
  const Value* value = find(name);
  if (!value) fail("needs the argument '" + std::string(name) + "'" + known());
  return *value;
}

double StrictArguments::number(std::string_view name, std::optional<double> missing) const {
  if (missing && !has(name)) return *missing;
  const Value& value = needed(name);
  if (value.kind != Value::number || !std::isfinite(value.as_number))
    fail(quoted(name) + " has to be a finite number");
  return value.as_number;
}

int StrictArguments::integer(std::string_view name, std::optional<double> missing) const {
  const double x = number(name, missing);
  if (x != std::trunc(x) || std::fabs(x) > 1000) fail(quoted(name) + " has to be a small whole number");
  return static_cast<int>(x);
}

int StrictArguments::dimension(std::optional<double> missing) const {
  const int d = integer("dimension", missing);
  if (!geometry::is_dimension(d))
    fail("has " + counted(d, "# dimension[s]; 1 to ") + std::to_string(NodePool::most_dimensions) +
         " are possible");
  return d;
}

std::vector<double> StrictArguments::numbers(std::string_view name) const {
  const Value& value = needed(name);
  if (value.kind == Value::number) return {number(name)};
  if (auto list = list_of(value)) return *list;
  fail(quoted(name) + " has to be a list of finite numbers");
}

std::vector<std::vector<double>> StrictArguments::lists(std::string_view name) const {
  const Value& value = needed(name);
  std::vector<std::vector<double>> lists;
  if (value.kind == Value::vector) {
    const Value* at = &value + 1;
    for (std::uint32_t i = 0; i < value.size; at += at->span, ++i) {
      auto list = list_of(*at);
      if (!list || list->empty() || (!lists.empty() && list->size() != lists.front().size())) break;
      lists.push_back(std::move(*list));
    }
  }
  if (lists.empty() || lists.size() != value.size)
    fail(quoted(name) + " has to be a list of lists of finite numbers, all of the same length");
  return lists;
}

bool StrictArguments::flag(std::string_view name) const {
  const Value* value = find(name);
  if (value && value->kind != Value::boolean) fail(quoted(name) + " has to be true or false");
  return value && value->as_number != 0;
}

std::string StrictArguments::text(std::string_view name) const {
  const Value* value = find(name);
  if (!value || value->kind != Value::text || value->size == 0)
    fail("needs a name, as in " + std::string(node_) + "(\"shaft\")");
  return arguments_.string(name, 0, "");
}

void StrictArguments::fail(const std::string& text) const { throw Error(std::string(node_) + ": " + text); }

std::string StrictArguments::known() const {
  if (names_.empty()) return "; it takes none";
  std::string text = "; it takes ";
  for (const std::string_view name : names_) text += (name == names_.front() ? "" : ", ") + std::string(name);
  return text;
}

}  // namespace bsp2::model
