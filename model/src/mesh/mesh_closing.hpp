#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/predicates.hpp"

namespace bsp2::model {

inline constexpr double largest_coordinate = 1e100;  ///< of a mesh: products of three stay finite

/// Faces of a mesh: cycles of point indices, one after the other.
struct FaceCycles {
  std::vector<std::uint32_t> corners;
  std::vector<std::size_t> ends;  ///< one past each face's last corner

  [[nodiscard]] std::size_t size() const { return ends.size(); }
  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t face) const {
    const std::size_t begin = face == 0 ? 0 : ends[face - 1];
    return {corners.data() + begin, ends[face] - begin};
  }
  void end_face() { ends.push_back(corners.size()); }
};

/// An edge a b, a < b, that the faces use `excess` times more often from a to b than from b to a.
struct OpenEdge {
  std::uint32_t a, b;
  int excess;
};

/// The edges that are not used equally often in both directions, sorted.
std::vector<OpenEdge> open_edges(const FaceCycles& faces);

/// Drops what bounds nothing: repeated corners, spikes (a b a), and faces whose corners all lie on one line.
FaceCycles without_degenerate(const std::vector<Point3>& points, const FaceCycles& faces);

/// How far apart two points of a text may be that were one point before they were rounded.
struct Tolerance {
  double absolute = 0;
  double relative = 0;  ///< of the distance of a point from the origin

  [[nodiscard]] bool exact() const { return absolute == 0 && relative == 0; }
  [[nodiscard]] double at(const Point3& p) const;
};

/// Merges the ends of open edges that lie within the tolerance of each other; other points stay as they are,
/// so a detail of the model that is closed as it stands survives whatever its size.
FaceCycles weld(const std::vector<Point3>& points, const FaceCycles& faces, const Tolerance& tolerance);

/// Inserts into every open edge the ends of other open edges that lie on it, within the tolerance or exactly:
/// closes T-vertices. Repeats until that changes nothing more.
FaceCycles split_at_t_vertices(const std::vector<Point3>& points, FaceCycles faces,
                               const Tolerance& tolerance);

}  // namespace bsp2::model
