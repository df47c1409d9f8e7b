#include "builder/matrix.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>

namespace bsp2::model {
namespace {

/// Divides a row or column (`n` entries, `step` apart) by a power of two so that its largest entry is in [1,
/// 2).
/// @return false if all its entries are zero.
bool scale_line(double* line, int n, int step) {
  double largest = 0;
  for (int i = 0; i < n; ++i) largest = std::max(largest, std::fabs(line[i * step]));
  if (largest == 0) return false;
  const int exponent = std::ilogb(largest);
  for (int i = 0; i < n; ++i) line[i * step] = std::scalbn(line[i * step], -exponent);
  return true;
}

/// Whether the linear part cannot be told from a singular one: elimination with full pivoting, on rows and
/// columns scaled by powers of two, meets a pivot no larger than the rounding of the doubles.
bool is_singular(std::vector<double> a, int n, int stride) {
  for (int column = 0; column < n; ++column)
    if (!scale_line(a.data() + column, n, stride)) return true;
  for (int row = 0; row < n; ++row)
    if (!scale_line(a.data() + row * stride, n, 1)) return true;
  const double smallest = 4 * n * std::numeric_limits<double>::epsilon();
  for (int step = 0; step < n; ++step) {
    int row = step, column = step;
    for (int i = step; i < n; ++i)
      for (int j = step; j < n; ++j)
        if (std::fabs(a[i * stride + j]) > std::fabs(a[row * stride + column])) row = i, column = j;
    if (std::fabs(a[row * stride + column]) <= smallest) return true;
    for (int j = 0; j < n; ++j) std::swap(a[step * stride + j], a[row * stride + j]);
    for (int i = 0; i < n; ++i) std::swap(a[i * stride + step], a[i * stride + column]);
    for (int i = step + 1; i < n; ++i) {
      const double factor = a[i * stride + step] / a[step * stride + step];
      for (int j = step; j < n; ++j) a[i * stride + j] -= factor * a[step * stride + j];
    }
  }
  return false;
}

/// Whether the columns of a 3 x 3 part are far from any plane together: such a matrix is not singular,
/// whatever is_singular would take into account. Most matrices pass, for less.
bool is_clearly_regular(const std::vector<double>& m) {
  const double determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                             m[2] * (m[4] * m[9] - m[5] * m[8]);
  double squares = 1;
  for (int column = 0; column < 3; ++column)
    squares *= m[column] * m[column] + m[4 + column] * m[4 + column] + m[8 + column] * m[8 + column];
  return squares > 1e-290 && determinant * determinant > 1e-6 * squares;
}

}  // namespace

MatrixKind normalize_affine(std::vector<double>& matrix) {
  const int stride =
      matrix.size() == 16 ? 4 : static_cast<int>(std::lround(std::sqrt(static_cast<double>(matrix.size()))));
  const int n = stride - 1;
  if (const double last = matrix.back(); last != 1)
    for (double& entry : matrix) entry /= last;
  if (!std::all_of(matrix.begin(), matrix.end(), [](double entry) { return std::isfinite(entry); }))
    return MatrixKind::not_finite;
  std::fill(matrix.end() - stride, matrix.end(), 0.0);
  matrix.back() = 1;
  if (n == 3 && is_clearly_regular(matrix)) return MatrixKind::regular;
  return is_singular(matrix, n, stride) ? MatrixKind::singular : MatrixKind::regular;
}

double volume_scale(const std::array<double, 16>& matrix) {
  std::vector<double> affine(matrix.begin(), matrix.end());
  normalize_affine(affine);
  using Quad = boost::multiprecision::cpp_bin_float_quad;  // a shear is a difference of large products
  const auto minor = [&](int i, int j) -> Quad {
    const auto at = [&](int row, int k) {
      return Quad(affine[static_cast<std::size_t>(4 * row + (j + k) % 3)]);
    };
    return at((i + 1) % 3, 1) * at((i + 2) % 3, 2) - at((i + 1) % 3, 2) * at((i + 2) % 3, 1);
  };
  Quad determinant = 0;
  for (int j = 0; j < 3; ++j) determinant += affine[static_cast<std::size_t>(j)] * minor(0, j);
  return std::fabs(static_cast<double>(determinant));
}

}  // namespace bsp2::model
