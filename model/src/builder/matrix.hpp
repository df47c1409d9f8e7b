#pragma once

#include <array>
#include <span>
#include <vector>

namespace bsp2::model {

enum class MatrixKind { regular, singular, not_finite };

/// What OpenSCAD makes of a (D+1) x (D+1) row-major matrix: divides it by its last entry, then forgets the
/// last row. `matrix` becomes affine; it is meaningful only if it is regular.
MatrixKind normalize_affine(std::vector<double>& matrix);

/// What the affine map of such a 4 x 4 matrix multiplies volumes by: the absolute value of its determinant,
/// within 1e-15 of it.
double volume_scale(const std::array<double, 16>& matrix);

}  // namespace bsp2::model
