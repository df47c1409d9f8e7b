#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace bsp2::model {
struct Model;
}

namespace bsp2 {

/// A node of the language with its operands, or the whole text of a model.
class Expression::Node {
 public:
  Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  /// However long the chain of what goes with it: no recursion.
  ~Node();

  std::string name;  ///< empty: a text
  std::string text;  ///< what stands between the parentheses; or the whole text
  std::vector<std::shared_ptr<const Node>> operands;
  int dimension = 3;
  std::uint64_t bytes = 0;  ///< of its text, at most; saturated

  // Of a text.
  std::string source;                 ///< what it is called in messages
  std::vector<std::string> warnings;  ///< of whoever translated it
  std::shared_ptr<const model::Model> read;

  [[nodiscard]] bool is_text() const { return name.empty(); }
};

/// A path from the root of the file system. @throws Error where there is none: no name, no current folder.
std::filesystem::path absolute_path(const std::filesystem::path& path);

/// The text of a model as it can stand within another one: what it names by relative paths is named by
/// absolute ones, and if something is tagged as the root (`!`), nothing but that is left.
std::string embedded(std::string_view text, const std::filesystem::path& folder);

}  // namespace bsp2
