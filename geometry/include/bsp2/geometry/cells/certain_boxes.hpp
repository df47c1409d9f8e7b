#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell.hpp"

namespace bsp2::geometry {

/// Holds something for certain: coordinates with their error bounds.
struct CertainBox {
  std::array<double, 3> low, high;

  /// Holds nothing.
  [[nodiscard]] static CertainBox empty();
  void add(const Vertex<3>& vertex);
  void add(const CertainBox& other);
};

/// Whether two boxes have no point in common; what is in them has none then, either.
[[nodiscard]] bool are_apart(const CertainBox& a, const CertainBox& b);

/// Things in groups of at most 64 that are near to each other: where they are is told in few boxes. Thread
/// rule: one thread at a time.
class BoxGroups {
 public:
  /// The box of one of them, by number.
  using BoxOf = std::function<CertainBox(std::uint32_t)>;

  void make(std::size_t count, const BoxOf& box_of);
  /// One of each group.
  [[nodiscard]] const std::vector<CertainBox>& boxes() const { return boxes_; }
  /// Those whose boxes are not apart from all of the others, ascending. @param box_of as for `make`.
  [[nodiscard]] std::vector<std::uint32_t> touching(std::span<const CertainBox> others,
                                                    const BoxOf& box_of) const;

 private:
  struct Item {
    std::array<double, 3> centre;  // twice
    std::uint32_t number;
  };
  static constexpr std::size_t most = 64;  // in a group
  std::vector<CertainBox> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<std::size_t> ends_;

  void part(std::span<Item> items, const BoxOf& box_of);
  void look(std::size_t first, std::size_t end, std::span<const CertainBox> others, const BoxOf& box_of,
            std::vector<std::uint32_t>& found) const;
};

}  // namespace bsp2::geometry
