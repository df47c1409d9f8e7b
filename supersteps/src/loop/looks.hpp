#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// As it is drawn, from a model's.
std::optional<Rgba> rounded(const std::optional<model::Colour>& colour);

/// What results of a run say besides cells and figures: what pictures and CAD files are made with. What is
/// round is found once, for the first result, since a run with frames has many.
template <int D>
class Looks {
 public:
  /// @param network must outlive it. @param with_rounds whether what is round is wanted.
  Looks(const dataflow::Network<D>& network, bool with_rounds)
      : network_(network), wants_rounds_(with_rounds) {}

  void add_to(RunResult& result, const std::vector<std::int32_t>& rank_of_region);

 private:
  const dataflow::Network<D>& network_;
  bool wants_rounds_;  // and has not found them
  std::shared_ptr<const RoundFaces> faces_;
  std::vector<geometry::RoundSolid> untouched_;

  void find_rounds();
};

}  // namespace bsp2::supersteps
