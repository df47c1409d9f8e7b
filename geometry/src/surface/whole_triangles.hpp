#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::geometry {

/// The triangles of a skin that are faces of the surface as they are, since all that meets at their corners
/// is such triangles (Skin::untouched). They go around the steps that bring the rest to faces.
///
/// A corner of theirs may be one of triangles that are not, as their other corners are touched. No edge of
/// these is divided or goes straight on there; only its name cannot be told from what of it is in the rest.
class WholeTriangles {
 public:
  /// Takes them out of a skin, with their vertices. @pre the faces are sorted, and the vertices as they came.
  explicit WholeTriangles(Skin& skin);
  /// The vertices of the rest are renumbered.
  void renumber(std::span<const std::uint32_t> map);
  /// Puts them back, with their points. @return of each point, whether it is one of theirs.
  std::vector<std::uint8_t> put_back(const HyperplaneTable<3>& table, unsigned threads, PointSet& points,
                                     Skin& skin);

 private:
  /// A vertex that the rest has, too.
  struct Shared {
    std::uint32_t own, rest;
  };
  Skin own_;  // without faces: the edges count those of all
  std::vector<Shared> shared_;

  void take_vertices(Skin& skin, std::span<const std::uint8_t> is_own);
};

}  // namespace bsp2::geometry
