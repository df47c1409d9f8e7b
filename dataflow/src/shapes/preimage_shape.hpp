#pragma once

#include <array>
#include <cstdint>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/dataflow/shapes/preimage.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// The frame of a preimage's hyperplanes, x = scale y + origin: coordinates within the box are at most 1
/// there.
template <int D>
struct PreimageFrame {
  std::array<double, D> scale, origin;
  std::uint32_t map = 0;  ///< its number in the hyperplane table
  explicit PreimageFrame(const Box<D>& box);
};

/// A preimage but for the ids of its hyperplanes. @param limit there are at most so many, or those of level
/// 0.
/// @throws bsp2::Error for splines outside of the plane and space.
template <int D>
Preimage<D> place_preimage(const model::Preimage& preimage,
                           const typename geometry::AffineMap<D>::Inverse& to_primitive,
                           const PreimageFrame<D>& frame, std::uint32_t limit);

}  // namespace bsp2::dataflow
