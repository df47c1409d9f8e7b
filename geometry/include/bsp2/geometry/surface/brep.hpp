#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/contact.hpp"

namespace bsp2::geometry {

/// The boundary of a solid as a complex of maximal plane faces, maximal straight edges and vertices, with the
/// shells that the faces make, and the solids that these bound.
///
/// Non-manifold where it must be: any even number of faces may meet in an edge, any number of shells in an
/// edge or a vertex. Where parts of the solid meet, their interfaces are faces, too, if the skin has them.
/// The combinatorics are exact; coordinates, normals, angles and volumes are rounded. It depends on the point
/// sets of the parts alone, not on cells, regions or ranks.
struct Brep {
  static constexpr std::int32_t outside = Skin::outside;

  /// One on each side of the plane at most is outside.
  struct Face {
    std::array<double, 3> normal;     ///< of unit length; out of `part`
    double offset;                    ///< normal * x + offset = 0 on the face
    std::int32_t part;                ///< behind the face, or `no_part`
    std::int32_t other;               ///< in front of it: `outside`, or a part
    std::uint32_t first_loop, loops;  ///< the first one is outside of the others, which are holes
  };
  /// The face is on the left of its loops, seen from outside: outlines are counter-clockwise, holes
  /// clockwise. A loop goes through each of its vertices once.
  struct Loop {
    std::uint32_t first_use, uses;
  };
  /// One side of a face on an edge. Those of a loop follow each other; they begin at its lowest vertex.
  struct Use {
    std::uint32_t edge, face;
    bool forward;  ///< from the edge's lower vertex to its higher one
    double angle;  ///< about the edge, from this face to the next one, in [0, 2 pi]; radians
  };
  struct Edge {
    std::array<std::uint32_t, 2> ends;  ///< vertices; the lower one first; two edges may round to the same
    std::uint32_t first, count;         ///< its uses are uses_of_edges[first ... first + count - 1]
  };
  /// The boundary of one piece of a part, or of one of its cavities.
  ///
  /// It goes on across an edge through the solid: pieces that touch in an edge or a vertex alone have shells
  /// of their own, and so have cavities that touch something in a vertex. But what touches in an edge is one
  /// where a face goes on across it, which is not divided there.
  struct Shell {
    std::int32_t part;
    std::uint32_t solid;
    std::uint32_t first, count;  ///< its faces are faces_of_shells[first ... first + count - 1]
    bool is_cavity;
    double volume;  ///< that it bounds; below 0 for a cavity
  };
  /// A side of a face. @see Shell
  struct Side {
    std::uint32_t face;
    bool is_front;  ///< the part is the face's `other`, and the face looks into it
  };
  /// A connected piece of a part: all that is inside of its outer shell and in no cavity.
  struct Solid {
    std::int32_t part;
    std::uint32_t first_shell, shells;  ///< the first one is the outer one, the others are cavities
    double volume;
  };

  std::vector<std::array<double, 3>> points;  ///< rounded; model units
  std::vector<Edge> edges;                    ///< by their ends
  std::vector<Face> faces;
  std::vector<Loop> loops;  ///< face by face
  std::vector<Use> uses;    ///< loop by loop
  /// Indices into `uses`, edge by edge: counter-clockwise about the edge, seen from its higher vertex.
  std::vector<std::uint32_t> uses_of_edges;
  std::vector<Shell> shells;          ///< solid by solid
  std::vector<Side> faces_of_shells;  ///< shell by shell
  std::vector<Solid> solids;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of all faces; counter-clockwise seen from outside
  std::vector<std::uint32_t> face_of_triangle;          ///< ascending
  bool is_closed = true;  ///< everywhere about each edge, faces agree on what is between them

  /// Where a use begins.
  [[nodiscard]] std::uint32_t from(const Use& use) const { return edges[use.edge].ends[use.forward ? 0 : 1]; }
  [[nodiscard]] std::span<const Use> uses_of(const Loop& loop) const {
    return {uses.data() + loop.first_use, loop.uses};
  }
  [[nodiscard]] std::span<const Loop> loops_of(const Face& face) const {
    return {loops.data() + face.first_loop, face.loops};
  }
  [[nodiscard]] std::span<const Side> sides_of(const Shell& shell) const {
    return {faces_of_shells.data() + shell.first, shell.count};
  }
};

/// The complex of a skin. @param surface gets what `triangulate` makes of it without interfaces, if not null.
/// @throws std::logic_error if it is not that of a solid.
[[nodiscard]] Brep brep_of(const HyperplaneTable<3>& table, Skin skin, TriangleSurface* surface = nullptr,
                           const ToldShare& told = {}, unsigned threads = 1);

/// Whether parts touch each other in faces of the complex.
[[nodiscard]] bool has_interfaces(const Brep& brep);

/// The triangles of all parts, each closed by itself: those of an interface are there twice, once a side.
[[nodiscard]] TriangleSurface surface_by_part(const Brep& brep);

}  // namespace bsp2::geometry
