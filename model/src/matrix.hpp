#pragma once

#include <span>
#include <vector>

namespace bsp2::model {

enum class MatrixKind { regular, singular, not_finite };

/// What OpenSCAD makes of a (D+1) x (D+1) row-major matrix: divides it by its last entry, then forgets the
/// last row. `matrix` becomes affine; it is meaningful only if it is regular.
MatrixKind normalize_affine(std::vector<double>& matrix);

}  // namespace bsp2::model
