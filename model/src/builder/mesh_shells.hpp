#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "bsp2/model/expression/expression.hpp"
#include "mesh/predicates.hpp"

namespace bsp2::model {

/// The smallest parts of a closed mesh that are closed by themselves and hang together over edges.
struct Shells {
  std::vector<std::uint32_t> of;  ///< the shell of each triangle
  std::uint32_t count = 0;
};

/// Time: proportional to the triangles. Two solids that share an edge or a vertex are two shells.
Shells shells_of(const TriangleMesh& mesh);

/// What is wrong with shells.
struct ShellFaults {
  std::uint32_t shells = 0;  ///< all of them
  std::uint32_t turned = 0, nested = 0;
  Point3 turned_at{}, nested_at{};  ///< a corner of the first one
};

/// Turns the shells of a closed mesh that are inside out, and finds those that lie within another one and are
/// wound like it.
///
/// A shell that does not lie in the solid of the others has to be wound counter-clockwise seen from outside,
/// one that does is a cavity, clockwise. Shells that contain others come first; a cavity is turned with the
/// shell around it. One that lies in the solid and is wound like it stays, since it may be meant as either.
/// "Lies in" is exact, by the winding number of the others beside some triangles of the shell, on its inner
/// side: shells that touch each other do not matter. Shells that cross lie in each other if all of these say
/// so. Time: n log n for n triangles of a mesh that is no heap of them.
ShellFaults turn_shells(TriangleMesh& mesh);

/// Points that the mesh winds around another number of times than 0 and 1.
struct OddWinding {
  int times;
  Point3 corner;  ///< of a triangle that they lie beside
};

/// The first of these in a closed mesh whose shells do not cross: what shells lie in is looked up beside one
/// triangle of each.
std::optional<OddWinding> odd_winding(const TriangleMesh& mesh);

}  // namespace bsp2::model
