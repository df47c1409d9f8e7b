#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/csg_arguments.hpp"

namespace bsp2::model {

/// The arguments of a node, strictly: what is unknown, missing or of another kind is an error that names it.
/// All throw bsp2::Error without a position.
class StrictArguments {
 public:
  /// @param node its name. @param names of its arguments in their order, with spaces between them.
  StrictArguments(std::string_view node, std::string_view names, const Arguments& arguments);

  [[nodiscard]] const Value* find(std::string_view name) const;
  [[nodiscard]] bool has(std::string_view name) const { return find(name) != nullptr; }
  [[nodiscard]] double number(std::string_view name, std::optional<double> missing = std::nullopt) const;
  [[nodiscard]] int integer(std::string_view name, std::optional<double> missing = std::nullopt) const;
  /// The argument `dimension`.
  [[nodiscard]] int dimension(std::optional<double> missing = std::nullopt) const;
  /// A number counts as a list of one.
  [[nodiscard]] std::vector<double> numbers(std::string_view name) const;
  [[nodiscard]] std::vector<std::vector<double>> lists(std::string_view name) const;
  [[nodiscard]] bool flag(std::string_view name) const;
  [[nodiscard]] std::string text(std::string_view name) const;
  [[nodiscard]] std::string_view node() const { return node_; }
  /// As they stand.
  [[nodiscard]] const Arguments& all() const { return arguments_; }
  [[noreturn]] void fail(const std::string& text) const;

 private:
  std::string_view node_;
  std::vector<std::string_view> names_;
  const Arguments& arguments_;

  [[nodiscard]] const Value& needed(std::string_view name) const;
  [[nodiscard]] std::string known() const;
};

/// The words of a text that has one space between them.
std::vector<std::string_view> words_of(std::string_view text);

}  // namespace bsp2::model
