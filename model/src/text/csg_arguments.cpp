#include "text/csg_arguments.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace bsp2::model {

const Value* Arguments::find(std::string_view name, int place) const {
  const Value* positional = nullptr;
  for (std::size_t i = arguments_.size(); i-- > 0;)
    if (arguments_[i].name == name) return &tape_[arguments_[i].value];
  int position = 0;
  for (const Argument& argument : arguments_) {
    if (!argument.name.empty()) continue;
    if (position++ == place) positional = &tape_[argument.value];
  }
  return positional;
}

double Arguments::number(std::string_view name, int place, double missing) const {
  const Value* value = find(name, place);
  return value && value->kind == Value::number ? value->as_number : missing;
}

std::string Arguments::string(std::string_view name, int place, std::string_view missing) const {
  const Value* value = find(name, place);
  if (!value || value->kind != Value::text) return std::string(missing);
  std::string text;
  for (const char *at = value->as_text, *end = at + value->size; at != end; ++at) {
    if (*at == '\\' && at + 1 != end) {
      ++at;
      text += *at == 'n' ? '\n' : *at == 't' ? '\t' : *at == 'r' ? '\r' : *at;
    } else {
      text += *at;
    }
  }
  return text;
}

bool Arguments::flag(std::string_view name, int place) const {
  const Value* value = find(name, place);
  return value && value->kind == Value::boolean && value->as_number != 0;
}

Resolution resolution_of(const Arguments& arguments) {
  Resolution resolution;
  const auto read = [&](std::string_view name, double& into) {
    if (const Value* value = arguments.find(name)) into = value->kind == Value::number ? value->as_number : 0;
  };
  read("$fn", resolution.fn);
  read("$fa", resolution.fa);
  read("$fs", resolution.fs);
  return resolution;
}

std::string text_of(double x) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr};
}

bool finite(std::initializer_list<double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace bsp2::model
