#include "shapes/preimage_shape.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "shapes/spline_shape.hpp"

namespace bsp2::dataflow {
namespace {

/// A solid and its frame: y_i = (p_i - origin_i) / scale_i. Axes of its space that it does not depend on are
/// left out.
struct Framed {
  preimage::Solid solid;
  std::vector<double> scale, origin;
};

Framed framed(const model::Round& round, int dimension, std::uint32_t limit) {
  const auto axes = static_cast<std::size_t>(dimension) - round.lengths.size();
  const double widest = std::max(round.bottom, round.top);
  const auto on_grid = [](double x) {
    return std::ldexp(static_cast<double>(std::llround(std::ldexp(x, 53))), -53);
  };
  Framed result{preimage::RoundSolid{{static_cast<int>(axes), on_grid(round.bottom / widest),
                                      on_grid(round.top / widest), limit}},
                std::vector<double>(axes, widest),
                {}};
  if (round.bottom != round.top) result.scale.push_back(round.lengths[0]);
  result.origin.resize(result.scale.size());
  return result;
}

Framed framed(const model::Torus& torus, int, std::uint32_t limit) {
  return {preimage::TorusSolid{geometry::RoundFamily<3>(2, 1, 1, limit / 8),
                               geometry::TorusFamily(torus.minor / torus.major, limit - limit / 8)},
          std::vector<double>(3, torus.major), std::vector<double>(3)};
}

template <int F, typename Surface>
Framed framed_patches(const Surface& surface, std::uint32_t limit) {
  PlacedPatches<F> placed = place<F>(surface, Transformer<F>());
  const auto placement = placed.placement;
  auto tree = std::make_shared<const PatchTree<F>>(std::move(placed.roots), placement, placed.error,
                                                   placed.weight_ratio, placed.closed, limit);
  return {preimage::PatchSolid<F>{std::move(tree)},
          std::vector<double>(F, placement.scale),
          {placement.origin.begin(), placement.origin.end()}};
}

Framed framed(const model::Spline& spline, int dimension, std::uint32_t limit) {
  if (dimension == 2) return framed_patches<2>(spline, limit);
  if (dimension == 3) return framed_patches<3>(spline, limit);
  throw Error("only splines of the plane and of space have products and sections");
}

Framed framed(const model::SubdivisionSurface& surface, int dimension, std::uint32_t limit) {
  if (dimension != 3) throw Error("only subdivision surfaces of space have products and sections");
  return framed_patches<3>(surface, limit);
}

}  // namespace

template <int D>
PreimageFrame<D>::PreimageFrame(const Box<D>& box) {
  double half = 0;
  for (int i = 0; i < D; ++i) {
    origin[i] = (box.lower[i] + box.upper[i]) / 2;
    half = std::max({half, box.upper[i] - origin[i], origin[i] - box.lower[i]});
  }
  scale.fill(std::ldexp(1.0, half > 0 ? std::ilogb(half) + 1 : 0));
}

template <int D>
Preimage<D> place_preimage(const model::Preimage& preimage,
                           const typename geometry::AffineMap<D>::Inverse& to_primitive,
                           const PreimageFrame<D>& frame, std::uint32_t limit) {
  Framed solid =
      std::visit([&](const auto& it) { return framed(it, preimage.dimension, limit); }, preimage.solid);
  Preimage<D> placed;
  placed.to_primitive = to_primitive;
  std::vector<typename PreimagePlanes<D>::Row> planes_rows;
  for (std::size_t i = 0; i < solid.scale.size(); ++i) {
    std::array<double, D + 1> row;
    for (std::size_t j = 0; j <= D; ++j)
      row[j] = (preimage.map[i * (D + 1) + j] - (j == D ? solid.origin[i] : 0)) / solid.scale[i];
    placed.rows.push_back(row);
    // The same from the hyperplanes' frame: p = matrix (scale u + frame.origin - origin).
    typename PreimagePlanes<D>::Row whole{};
    whole[D] = static_cast<long double>(row[D]);
    for (std::size_t j = 0; j < D; ++j)
      for (std::size_t k = 0; k < D; ++k) {
        const long double entry =
            static_cast<long double>(row[j]) * static_cast<long double>(to_primitive.matrix[j][k]);
        whole[k] += entry * static_cast<long double>(frame.scale[k]);
        whole[D] += entry * (static_cast<long double>(frame.origin[k]) -
                             static_cast<long double>(to_primitive.origin[k]));
      }
    for (std::size_t k = 0; k < D; ++k)
      placed.weight[k] =
          std::max(placed.weight[k], static_cast<double>(std::fabs(whole[k])) / frame.scale[k]);
    planes_rows.push_back(whole);
  }
  const double heaviest = *std::max_element(placed.weight.begin(), placed.weight.end());
  for (double& weight : placed.weight)
    if (weight < 1e-9 * heaviest) weight = 0;
  placed.planes = std::make_shared<const PreimagePlanes<D>>(std::move(solid.solid), std::move(planes_rows));
  return placed;
}

#define BSP2_INSTANTIATE(D)                                                               \
  template struct PreimageFrame<D>;                                                       \
  template Preimage<D> place_preimage<D>(const model::Preimage&,                          \
                                         const typename geometry::AffineMap<D>::Inverse&, \
                                         const PreimageFrame<D>&, std::uint32_t);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
