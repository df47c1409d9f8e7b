#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/support/buffer.hpp"

namespace bsp2::geometry {

/// Triangles in space by coordinate, to hold all of them against one plane.
///
/// Thread rule: one thread at a time.
class TriangleColumns {
 public:
  /// Where corners of a triangle are: any of these.
  enum Sides : std::uint8_t { below = 1, between = 2, above = 4 };

  /// What was in it is gone. @post the corners of `count` triangles are to be set.
  void resize(std::size_t count);
  void set(std::size_t triangle, std::size_t corner, const std::array<double, 3>& point) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      coordinates_[(3 * corner + axis) * padded_ + triangle] = point[axis];
  }
  /// For each triangle the `Sides` of its corners: where the plane's value is below `low`, above `high`, or
  /// between. Values are those of Hyperplane::at, on every processor. Valid until the next call. @pre low <=
  /// high
  [[nodiscard]] std::span<const std::uint8_t> sides(const Hyperplane<3>& plane, double low, double high);

 private:
  std::size_t count_ = 0, padded_ = 0;  // columns have room for whole vectors
  Buffer<double> coordinates_;          // a column for each coordinate of each corner
  Buffer<std::uint8_t> sides_;
};

}  // namespace bsp2::geometry
