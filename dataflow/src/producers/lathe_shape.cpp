#include "producers/lathe_shape.hpp"

#include <algorithm>
#include <cmath>

#include "producers/lathe_producer.hpp"

namespace bsp2::dataflow {

LatheShape::LatheShape(std::uint32_t sides, std::vector<double> radius, std::vector<double> z,
                       std::vector<geometry::Covector<3>>& covectors) {
  lathe.sides = sides;
  lathe.bands = static_cast<std::uint32_t>(z.size() - 1);
  facet_count = covectors.size();
  cap_count = facet_count - std::size_t{sides} * lathe.bands;
  lathe.widest = static_cast<std::size_t>(std::max_element(radius.begin(), radius.end()) - radius.begin());
  // Blocks of about `few_facets`, as square as the bands allow.
  constexpr auto few = static_cast<std::uint32_t>(LatheProducer::few_facets);
  lathe.bands_between = std::min(lathe.bands, few / 8);
  lathe.sides_between = few / lathe.bands_between;
  for (std::uint32_t at = 0; at < sides; at += lathe.sides_between) {
    lathe.axial.push_back({{}, at, true});
    covectors.push_back(geometry::axial_covector(at, sides));
  }
  for (std::uint32_t at = lathe.bands_between; at < lathe.bands; at += lathe.bands_between) {
    lathe.level.push_back({{}, at, false});
    covectors.push_back(geometry::level_covector(z[at]));
  }
  lathe.radius = std::move(radius);
  lathe.z = std::move(z);
}

Lathe place_lathe(const LatheShape& shape, const Transformer<3>& placement,
                  std::span<const geometry::OrientedHyperplane> planes, double radius, double moved) {
  using geometry::Float128;
  Lathe lathe = shape.lathe;
  for (std::size_t cap = 0; cap < shape.cap_count; ++cap) lathe.caps.push_back(planes[cap].code);
  std::size_t next = shape.facet_count;
  for (auto* partings : {&lathe.axial, &lathe.level})
    for (Lathe::SplitPosition& parting : *partings) {
      parting.plane = planes[next++];
      lathe.by_id.emplace_back(parting.plane.id(), parting);
    }
  std::stable_sort(lathe.by_id.begin(), lathe.by_id.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });

  // The inverse map. Its errors: of the matrix and of the products, relative to the coordinates that cancel.
  const auto& m = placement.matrix();
  const auto cofactor = [&](int i, int j) {
    const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[a][c] * m[b][d] - m[a][d] * m[b][c];
  };
  const Float128 determinant = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
  for (int i = 0; i < 3; ++i) {
    Float128 shift = 0;
    double sum = 0, magnitude = 0;
    for (int j = 0; j < 3; ++j) {
      const Float128 entry = cofactor(j, i) / determinant;
      lathe.to_frame[i][j] = static_cast<double>(entry);
      shift -= entry * m[j][3];
      sum += lathe.to_frame[i][j] * lathe.to_frame[i][j];
      magnitude += std::fabs(lathe.to_frame[i][j]) * (radius + std::fabs(static_cast<double>(m[j][3])));
    }
    lathe.to_frame[i][3] = static_cast<double>(shift);
    lathe.frame_scale =
        std::max(lathe.frame_scale, std::sqrt(sum) * 1.5);  // 1.5: of two coordinates together
    lathe.frame_error = std::max(lathe.frame_error, (magnitude + 1) * 0x1p-49);
  }
  lathe.slack = moved * lathe.frame_scale;
  return lathe;
}

}  // namespace bsp2::dataflow
