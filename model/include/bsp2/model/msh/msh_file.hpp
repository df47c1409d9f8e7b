#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bsp2::model {

/// A mesh as it lies in a file of gmsh.
struct MshFile {
  /// Elements of one dimension with one physical group, or else of one entity.
  struct Group {
    std::string name;                                  ///< empty: none
    std::vector<std::vector<std::uint32_t>> elements;  ///< corners, as indices of points
  };
  using Key = std::pair<bool, std::int64_t>;  ///< is it a physical group; its number

  std::vector<std::array<double, 3>> points;
  std::map<Key, Group> surfaces, volumes;
  std::size_t curved = 0;              ///< elements of higher order
  std::vector<std::uint32_t> between;  ///< their points that are no corners; some are in it more than once
  /// Of its first data of one number: where a node or the middle of an element is, and the number.
  std::vector<std::array<double, 4>> data;
};

/// Reads versions 2.2 and 4.1, text and binary. Lines and points alone are passed over.
/// @param path of the file in messages.
/// @throws bsp2::Error with the line or byte of what is damaged or cut off.
/// @param with_data read `data`, too.
MshFile read_msh(std::string_view bytes, const std::filesystem::path& path, bool with_data = false);

/// Reads a file of versions 2.2 and 4.1. @throws bsp2::Error as for its bytes, and if it cannot be read.
MshFile read_msh(const std::filesystem::path& path, bool with_data = false);

}  // namespace bsp2::model
