#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "serving/reader.hpp"

namespace bsp2::api {

/// An edge of a plane figure; what it goes around is on its left.
struct FigureEdge {
  std::array<double, 2> from, to;  ///< u and v
};

/// Between two lines along u.
struct Trapezoid {
  double low, high;                   ///< v
  std::array<double, 2> left, right;  ///< u at `low` and at `high`
  friend bool operator==(const Trapezoid&, const Trapezoid&) = default;
};

/// Fills a figure: disjoint trapezoids that together are what its edges go around, counter-clockwise, more
/// often than the other way. Edges that cross each other are taken in the order in which they are halfway
/// between two ends of edges.
/// @param step of a lattice to which ends go first; 0: they stay.
std::vector<Trapezoid> filled(std::span<const FigureEdge> edges, double step = 0);

/// What a plane of a gaze cuts open, see Sections: each part of a surface, or of each region of cells, which
/// are closed by themselves, as they are at their finest level; so it does not depend on what a page has of
/// them. Where there would be more than two triangles for each pixel (or than two boxes have), ends of edges
/// go to a lattice whose steps are at least half a pixel.
Scene::Bytes section_of(const Scene& scene, const Gaze& gaze, std::size_t plane, std::uint64_t& state);

}  // namespace bsp2::api
