#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace bsp2::api {

/// Triangles as the boundary of the voxels that they touch: what a crowd of small things looks like from
/// far away.
///
/// A voxel is there where a triangle is; one that lies between two voxels belongs to that which is behind it.
/// Of its six sides those are drawn behind which no other voxel is, and to which some of its triangles face.
/// So crowds have the hull of the crowd, sheets both of their sides, and a patch of a surface its front
/// alone.
///
/// Corners go to the mean plane of the triangles about them, as far as these have one, by at most half an
/// edge along each axis: a ball stays round so. Then they go into the box of these triangles: a needle is as
/// thin as it is. So whatever is drawn is at most 1.5 sqrt(3) edges from a triangle, and what is not drawn
/// lies in a voxel that others are around.
class Voxels {
 public:
  using Point = std::array<double, 3>;
  /// The boundary.
  struct Hull {
    std::vector<Point> points;             ///< in steps
    std::vector<std::uint32_t> looks;      ///< one a point
    std::vector<std::uint32_t> triangles;  ///< 3 a triangle
    std::vector<std::uint32_t> owners;     ///< one a triangle, ascending
  };

  /// @param places 3 a point, below 2^16. @param corners 3 a triangle. @param owners one a triangle.
  /// @param exponent the edge of a voxel is 2^exponent, in steps of the places.
  Voxels(std::span<const std::uint32_t> places, std::span<const std::uint32_t> corners,
         std::span<const std::uint32_t> owners, int exponent);
  /// The exponent from which on there are not many more voxels than triangles.
  static int first_exponent(std::span<const std::uint32_t> places, std::span<const std::uint32_t> corners);

  /// Makes the edges twice as long.
  void coarsen();
  /// How many triangles the boundary has; those without area, which are left out of it, too.
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] int exponent() const { return exponent_; }
  [[nodiscard]] bool is_one() const { return voxels_.size() <= 1; }
  /// @param look_of_owner points of owners that look different are different ones; empty: all look alike.
  [[nodiscard]] Hull hull(std::span<const std::uint32_t> look_of_owner) const;

 private:
  using Place = std::array<std::int32_t, 3>;
  /// What is known of the triangles in a voxel; all in steps.
  struct Voxel {
    std::uint64_t code = 0;                      ///< its place
    Point normal{}, moment{}, lower{}, upper{};  ///< the first two times the area
    double area = 0, area_of_owner = 0;
    std::uint32_t owner = 0;  ///< whose triangle has most of its area
    /// A bit for each side, along -x, x, -y, y, -z, z: to which some triangle faces; which is drawn.
    std::uint8_t faced = 0, shown = 0;
  };
  class Marking;
  class Corners;
  int exponent_;
  std::vector<Voxel> voxels_;  ///< by code

  [[nodiscard]] const Voxel* at(const Place& place) const;
  void find_shown();
};

}  // namespace bsp2::api
