#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace bsp2::api {

/// What can be sent as coarsely as who looks may see it.
///
/// A level is the exponent of the step of a lattice. What is on the lattice of a level is on all finer ones,
/// and a point goes to the same place in all that are at one level. Coarser than all these are levels of
/// voxels, at which nothing is lost, however small: `voxels` and the exponent of their edge.
struct Detail {
  enum class Kind : std::uint8_t { surface, cells };
  static constexpr std::int32_t several_parts = -2;
  /// The level at which nothing is left of it.
  static constexpr int nothing = std::numeric_limits<int>::max();
  static constexpr int voxels = 1 << 16;  ///< far above all exponents of numbers
  static bool is_of_voxels(int level) { return level > voxels / 2 && level != nothing; }

  Kind kind = Kind::surface;
  std::uint64_t run = 0;
  std::uint32_t number = 0;           ///< among those of its kind
  std::int32_t part = several_parts;  ///< whose it is; -1: of no part
  std::array<double, 3> lower{}, upper{};
  int finest = 0, coarsest = 0;  ///< levels; at `coarsest` it still shows where it is
  /// The last level at which there still is something of each thing in it that hangs together.
  int whole = 0;
  /// How many are left at levels from `finest` on, about; at those above the last as many as at that.
  std::vector<std::uint32_t> triangles;
  /// How many there are at levels of voxels, about, from the exponent `finest_voxels` on; the last is that
  /// of a voxel or two.
  int finest_voxels = 0;
  std::vector<std::uint32_t> triangles_of_voxels;
  /// Makes the bytes of a level from those of the finest one. Called by any thread.
  std::function<std::string(const std::string& bytes, int level)> coarser;
  /// The parts in a region of cells, ascending; they are hidden one by one.
  std::vector<std::int32_t> parts;
  /// Without some of them: the bytes of that, and what can be sent of these. Called by any thread.
  std::function<std::pair<std::string, std::shared_ptr<const Detail>>(const std::string& bytes,
                                                                      const std::set<std::int32_t>& hidden)>
      without;

  [[nodiscard]] std::uint32_t triangles_at(int level) const {
    if (triangles.empty()) return 0;
    const auto above = static_cast<std::size_t>(level > finest ? level - finest : 0);
    return triangles[above < triangles.size() ? above : triangles.size() - 1];
  }
  /// The finest level of voxels with no more triangles than that and no shorter edges; else the coarsest one.
  /// There must be one.
  [[nodiscard]] int voxels_with(double most_triangles, int least_exponent) const {
    std::size_t above = 0;
    while (above + 1 < triangles_of_voxels.size() &&
           (finest_voxels + static_cast<int>(above) < least_exponent ||
            triangles_of_voxels[above] > most_triangles))
      ++above;
    return voxels + finest_voxels + static_cast<int>(above);
  }
};

}  // namespace bsp2::api
