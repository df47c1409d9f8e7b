#pragma once

#include <array>
#include <optional>
#include <vector>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// The corners of the convex hull, counter-clockwise; fewer than three where it is flat.
///
/// Convex by exact comparisons. Points that lie outside by less than 2^-46 of the largest coordinate are
/// passed over.
std::vector<std::array<double, 2>> hull_corners(const std::vector<std::array<double, 2>>& points);

/// The convex hull as a mesh whose corners are some of the points, rounded to multiples of 2^-53 of the
/// largest coordinate; nothing where it is flat.
///
/// Convex by exact comparisons. Points that lie outside by less than 2^-46 of the largest coordinate are
/// passed over.
std::optional<TriangleMesh> hull_mesh(const std::vector<std::array<double, 3>>& points);

}  // namespace bsp2::model
