#include "bsp2/dataflow/shapes/preimage.hpp"

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {
namespace preimage {
namespace {

template <std::size_t N>
Covector padded(const std::array<long double, N>& covector) {
  Covector result{};
  std::copy_n(covector.begin(), N - 1, result.begin());
  result[most_axes] = covector[N - 1];
  return result;
}

/// Of length 1; `outward` moves it along its normal.
Covector shifted(Covector covector, long double outward) {
  long double square = 0;
  for (std::size_t i = 0; i < most_axes; ++i) square += covector[i] * covector[i];
  if (square > 0)
    for (long double& x : covector) x /= std::sqrt(square);
  covector[most_axes] -= outward;
  return covector;
}

/// Tangents go outward, chords inward, what goes through the axis stays.
Covector of(const RoundSolid& solid, std::uint32_t number) {
  const auto& family = solid.family;
  const std::uint32_t first_tangent = family.tangent({});
  const long double outward = number < first_tangent              ? 0
                              : (number - first_tangent) % 2 == 0 ? margin
                                                                  : -margin;
  return shifted(padded(family.rounded(number)), outward);
}

/// The torus' planes have such a margin of their own.
Covector of(const TorusSolid& solid, std::uint32_t number) {
  const std::uint32_t radials = solid.fan.count();
  return number < radials ? padded(solid.fan.rounded(number))
                          : padded(solid.family.rounded(number - radials));
}

template <int F>
Covector of(const PatchSolid<F>& solid, std::uint32_t number) {
  std::array<long double, F + 1> covector{};
  const auto coefficients = solid.tree->covector(number);
  for (std::size_t i = 0; i <= F; ++i) covector[i] = static_cast<long double>(coefficients[i]);
  return shifted(padded(covector), margin);
}

std::uint32_t count_of(const RoundSolid& solid) { return solid.family.count(); }
std::uint32_t count_of(const TorusSolid& solid) { return solid.fan.count() + solid.family.count(); }
template <int F>
std::uint32_t count_of(const PatchSolid<F>& solid) {
  return solid.tree->count();
}

}  // namespace

std::size_t RoundSolid::axes() const {
  return static_cast<std::size_t>(family.axes()) + (family.bottom() == family.top() ? 0 : 1);
}
Covector covector(const Solid& solid, std::uint32_t number) {
  return std::visit([&](const auto& it) { return of(it, number); }, solid);
}
std::uint32_t count(const Solid& solid) {
  return std::visit([](const auto& it) { return count_of(it); }, solid);
}

}  // namespace preimage

template <int D>
std::array<std::int64_t, D + 1> PreimagePlanes<D>::covector(std::uint32_t number) const {
  const preimage::Covector of_solid = preimage::covector(solid_, number);
  Row row{};
  for (std::size_t i = 0; i < rows_.size(); ++i)
    for (std::size_t j = 0; j <= D; ++j) row[j] += of_solid[i] * rows_[i][j];
  row[D] += of_solid[preimage::most_axes];
  long double largest = 0;
  for (const long double x : row) largest = std::max(largest, std::fabs(x));
  std::array<std::int64_t, D + 1> covector{};
  if (largest > 0)
    for (std::size_t j = 0; j <= D; ++j)
      covector[j] = static_cast<std::int64_t>(std::llround(std::ldexp(row[j], 58 - std::ilogb(largest))));
  return covector;
}

#define BSP2_INSTANTIATE(D) template class PreimagePlanes<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
