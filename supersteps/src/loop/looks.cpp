#include "loop/looks.hpp"

#include <cmath>
#include <utility>

#include "bsp2/dataflow/surface/untouched.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "render/round_faces.hpp"

namespace bsp2::supersteps {

std::optional<Rgba> rounded(const std::optional<model::Colour>& colour) {
  if (!colour) return std::nullopt;
  Rgba rgba;
  for (int i = 0; i < 4; ++i) rgba[i] = static_cast<std::uint8_t>(std::lround(255 * (*colour)[i]));
  return rgba;
}

template <int D>
void Looks<D>::find_rounds() {
  if constexpr (D == 3) {
    auto faces = std::make_shared<const RoundFaces>(network_);
    if (!faces->is_empty()) faces_ = std::move(faces);
    untouched_ = dataflow::untouched_rounds(network_);
  }
}

template <int D>
void Looks<D>::add_to(RunResult& result, const std::vector<std::int32_t>& rank_of_region) {
  if (wants_rounds_) find_rounds();
  wants_rounds_ = false;
  result.rank_of_region = rank_of_region;
  for (const auto& colour : network_.colours) result.colour_of_primitive.push_back(rounded(colour));
  for (const auto& part : network_.parts) result.part_names.push_back(part.name);
  result.round_faces = faces_;
  result.untouched_rounds = untouched_;
  if (network_.bounds.is_empty()) return;
  result.bounds.lower.assign(network_.bounds.lower.begin(), network_.bounds.lower.end());
  result.bounds.upper.assign(network_.bounds.upper.begin(), network_.bounds.upper.end());
}

#define BSP2_LOOKS(D) template class Looks<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_LOOKS)
#undef BSP2_LOOKS

}  // namespace bsp2::supersteps
