#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

/// What stands in a DXF file, before anything is drawn of it.
namespace bsp2::model::dxf {

/// One thing that is drawn. Its numbers stand in their order, for the corners of a polyline are told apart by
/// nothing else.
struct Entity {
  std::string type, layer, name;                         ///< the name of the block that is inserted
  std::vector<std::pair<std::int16_t, double>> numbers;  ///< group code and value
  std::vector<Entity> vertices;                          ///< of a POLYLINE
  std::string fault;  ///< the first value that is no number: "line: what is wrong"; empty if all are

  /// The first number of a group code; `missing` if there is none.
  [[nodiscard]] double number(int code, double missing = 0) const;
  [[nodiscard]] bool has(int code) const;
  /// Whether this bit of a number is set.
  [[nodiscard]] bool flag(int code, std::int64_t bit) const;
  /// All numbers of a group code, in their order.
  [[nodiscard]] std::vector<double> all(int code) const;
};

/// Entities that stand in no drawing until an INSERT puts them there.
struct Block {
  Entity head;  ///< with the base point, which an INSERT puts at its own point
  std::vector<Entity> entities;
};

struct File {
  std::vector<Entity> entities;
  std::unordered_map<std::string, Block> blocks;  ///< by their names in capital letters
  int units = 0;                                  ///< $INSUNITS; 0: it says nothing
  /// The block of that name, in whatever letters; null if there is none.
  [[nodiscard]] const Block* find_block(const std::string& name) const;
};

/// @throws bsp2::Error if the file cannot be read, is cut off, or is binary.
File read_file(const std::filesystem::path& path);

}  // namespace bsp2::model::dxf
