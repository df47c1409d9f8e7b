#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "bsp2/model/expression/tessellation.hpp"
#include "text/csg_scanner.hpp"

namespace bsp2::model {

/// The arguments of one node, by name or by place.
class Arguments {
 public:
  Arguments(std::span<const Argument> arguments, std::span<const Value> tape)
      : arguments_(arguments), tape_(tape) {}
  /// The value named `name`, else the positional one at `place` (< 0: none), else null. The last of several
  /// counts.
  [[nodiscard]] const Value* find(std::string_view name, int place = -1) const;
  /// The number of that name; `missing` if there is none or if it is no number.
  [[nodiscard]] double number(std::string_view name, int place, double missing) const;
  /// The string of that name; `missing` if there is none.
  [[nodiscard]] std::string string(std::string_view name, int place, std::string_view missing) const;
  [[nodiscard]] bool flag(std::string_view name, int place) const;
  [[nodiscard]] std::span<const Argument> all() const { return arguments_; }

 private:
  std::span<const Argument> arguments_;
  std::span<const Value> tape_;
};

using Warn = std::function<void(std::string)>;

/// `$fn`, `$fa`, `$fs`: what is no number counts as 0, as in OpenSCAD.
Resolution resolution_of(const Arguments& arguments);

/// Two or three numbers; one number counts for all of them.
template <std::size_t N>
void read_numbers(const Value* value, std::array<double, N>& into) {
  if (!value) return;
  if (value->kind == Value::number) into.fill(value->as_number);
  if (value->kind != Value::vector) return;
  const Value* at = value + 1;
  for (std::uint32_t i = 0; i < std::min<std::uint32_t>(value->size, N); at += at->span, ++i)
    if (at->kind == Value::number || at->kind == Value::boolean) into[i] = at->as_number;
}

/// The shortest text of a number.
std::string text_of(double x);

bool finite(std::initializer_list<double> numbers);

}  // namespace bsp2::model
