#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace bsp2::api {

/// What can be sent as coarsely as who looks may see it: on lattices whose steps are powers of two.
///
/// A level is the exponent of a step. What is on the lattice of a level is on all finer ones, and a point
/// goes to the same place in all that are at one level.
struct Detail {
  enum class Kind : std::uint8_t { surface, cells };
  static constexpr std::int32_t several_parts = -2;
  /// The level at which nothing is left of it.
  static constexpr int nothing = std::numeric_limits<int>::max();

  Kind kind = Kind::surface;
  std::uint64_t run = 0;
  std::uint32_t number = 0;           ///< among those of its kind
  std::int32_t part = several_parts;  ///< whose it is; -1: of no part
  std::array<double, 3> lower{}, upper{};
  int finest = 0, coarsest = 0;  ///< levels; `coarsest` still shows where it is
  /// How many are left at levels from `finest` on, about; at those above the last as many as at that.
  std::vector<std::uint32_t> triangles;
  /// Makes the bytes of a level from those of the finest one. Called by any thread.
  std::function<std::string(const std::string& bytes, int level)> coarser;

  /// The finest level with no more triangles than that; where there is none, the coarsest that has some.
  [[nodiscard]] int level_with(double most_triangles) const {
    std::size_t above = 0;
    while (above + 1 < triangles.size() && triangles[above] > most_triangles && triangles[above + 1] > 0)
      ++above;
    return finest + static_cast<int>(above);
  }
};

}  // namespace bsp2::api
