#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bsp2/geometry/exact/hyperplane.hpp"

namespace bsp2::dataflow {

/// A placed stack of regular polygons (model::Lathe) with so many facets that they are never all looked at.
///
/// Facet (band, side) lies between rings band and band + 1 and corners side and side + 1. Its half-space is
/// number cap_count + side * bands + band among the producer's; the caps come first. In its own frame the
/// axis is z, the largest radius 1, and z goes from 0 to 1.
struct Lathe {
  std::uint32_t sides = 0, bands = 0;
  std::vector<double> radius, z;    ///< of the rings, in the own frame
  std::size_t widest = 0;           ///< the ring with the largest radius
  std::vector<std::uint32_t> caps;  ///< codes of the half-spaces below and above; none at an apex

  /// Planes that part the facets, for cuts: through the axis and corner `at` (positive where angles grow),
  /// and across it at ring `at` (positive above).
  struct SplitPosition {
    geometry::OrientedHyperplane plane;
    std::uint32_t at;
    bool axial;
  };
  std::uint32_t sides_between = 1, bands_between = 1;                   ///< from one plane to the next
  std::vector<SplitPosition> axial, level;                              ///< by `at`
  std::vector<std::pair<geometry::HyperplaneId, SplitPosition>> by_id;  ///< both, by id

  std::array<std::array<double, 4>, 3> to_frame;  ///< rounded; from the model to the own frame
  double frame_error = 0;                         ///< of a point's coordinates in the own frame, by rounding
  double frame_scale = 0;  ///< the length in the own frame of a unit of the model, at most
  double slack = 0;        ///< in the own frame: how far merging may have moved a half-space
};

/// What is round about a stack of regular polygons: by it pictures tell how its facets bend.
///
/// Facets are numbered as those of a Lathe, and so are their covectors in the table, from the first one on.
struct TurnedShape {
  std::uint32_t first_covector = 0, sides = 0;
  std::vector<std::pair<double, double>> rings;  ///< radius and z, in the frame as of a Lathe
};

/// One that is placed.
struct Turned {
  std::uint32_t map = 0;                     ///< in the table, from the frame into the model
  std::int32_t primitive = 0;                ///< its number in the source
  std::shared_ptr<const TurnedShape> shape;  ///< shared: by all occurrences of it
};

}  // namespace bsp2::dataflow
