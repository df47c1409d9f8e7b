#include "bsp2/geometry/cells/triangle_columns.hpp"

#include <algorithm>
#include <cstring>

#include "support/vector_lanes.hpp"

namespace bsp2::geometry {

namespace {

/// @param coordinates nine columns of `count` numbers, a multiple of the lanes.
BSP2_VECTOR_CLONES void find_triangle_sides(const double* coordinates, std::size_t count,
                                            const Hyperplane<3>& plane, double low, double high,
                                            std::uint8_t* sides) {
  // Numbers whose lowest bits are the sides: choices between constants, others the compiler makes one lane at
  // a time.
  const auto number = [](TriangleColumns::Sides side) {
    return 0x1p52 + static_cast<double>(static_cast<int>(side));
  };
  const WideLanes zero{}, below = zero + number(TriangleColumns::below),
                          between = zero + number(TriangleColumns::between),
                          above = zero + number(TriangleColumns::above);
  for (std::size_t at = 0; at < count; at += wide) {
    WideBits all{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      WideLanes value = WideLanes{} + plane.offset;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        WideLanes coordinate;
        std::memcpy(&coordinate, coordinates + (3 * corner + axis) * count + at, sizeof coordinate);
        value += plane.normal[axis] * coordinate;
      }
      const WideLanes found = value < low ? below : value > high ? above : between;
      WideBits bits;
      std::memcpy(&bits, &found, sizeof bits);
      all |= bits;
    }
    const auto bytes = __builtin_convertvector(all, WideBytes);  // the lowest eight bits of each
    std::memcpy(sides + at, &bytes, sizeof bytes);
  }
}

}  // namespace

void TriangleColumns::resize(std::size_t count) {
  count_ = count;
  padded_ = (count + wide - 1) / wide * wide;
  coordinates_.clear();
  coordinates_.resize(9 * padded_);
  for (std::size_t column = 0; column < 9; ++column)
    std::fill_n(coordinates_.begin() + column * padded_ + count, padded_ - count, 0.0);
  sides_.resize(padded_);
}

std::span<const std::uint8_t> TriangleColumns::sides(const Hyperplane<3>& plane, double low, double high) {
  find_triangle_sides(coordinates_.data(), padded_, plane, low, high, sides_.data());
  return {sides_.data(), count_};
}

}  // namespace bsp2::geometry
