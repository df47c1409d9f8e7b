#include <cmath>
#include <numbers>

#include "bsp2/geometry/support/dimensions.hpp"
#include "regions/progress_exchange.hpp"
#include "stages/stages.hpp"
#include "state/evaluate_options.hpp"

namespace bsp2::supersteps {

namespace {

dataflow::EvaluateOptions evaluate_options(const RunOptions& options, unsigned threads,
                                           const Recorded& so_far) {
  dataflow::EvaluateOptions evaluate = limits_of(options, threads);
  evaluate.order = options.order;
  evaluate.eye = options.eye;
  if (options.angle) evaluate.angle = *options.angle * std::numbers::pi / 180;
  evaluate.suspend = evaluate.hold_uniform_regions = evaluate.same_limits = true;
  evaluate.keep_in = options.keep_in;
  evaluate.keep_fuzzy = options.keep_fuzzy;
  evaluate.keep_out = options.keep_out;
  evaluate.record_tree = options.collect_cells;
  evaluate.recorded_nodes = so_far.nodes;
  evaluate.recorded_cells = so_far.cells;
  return evaluate;
}

}  // namespace

template <int D>
Computed<D> computation(Ranks& ranks, const dataflow::Network<D>& network,
                        std::vector<dataflow::Region<D>> regions, const RunOptions& options, unsigned threads,
                        const Recorded& so_far, std::optional<std::uint64_t> quota, CellStream* stream,
                        std::span<dataflow::Consumer* const> consumers) {
  double share = 0;  // of space
  for (const auto& region : regions) share += std::ldexp(1.0, -int{region.level});
  ProgressExchange exchange(ranks, share, so_far.cells, {options.move_after_seconds, options.cells},
                            options.on_progress, stream);
  std::vector<dataflow::Consumer*> all(consumers.begin(), consumers.end());
  if (stream != nullptr) all.push_back(stream);
  all.push_back(&exchange);
  dataflow::EvaluateOptions evaluate = evaluate_options(options, threads, so_far);
  evaluate.cells = quota;
  evaluate.interrupted = [&] { return exchange.is_over() || (options.interrupted && options.interrupted()); };
  auto evaluation = dataflow::evaluate(network, std::move(regions), evaluate, all);
  exchange.finish();
  return {std::move(evaluation), exchange.shall_move()};
}

template <int D>
dataflow::Evaluation<D> provisional_cells(const dataflow::Network<D>& network,
                                          std::span<const dataflow::Region<D>> regions,
                                          const RunOptions& options, unsigned threads, const Recorded& so_far,
                                          std::span<dataflow::Consumer* const> consumers) {
  return dataflow::picture<D>(network, regions, evaluate_options(options, threads, so_far), consumers);
}

#define BSP2_STAGE(D)                                                                                     \
  template Computed<D> computation<D>(                                                                    \
      Ranks&, const dataflow::Network<D>&, std::vector<dataflow::Region<D>>, const RunOptions&, unsigned, \
      const Recorded&, std::optional<std::uint64_t>, CellStream*, std::span<dataflow::Consumer* const>);  \
  template dataflow::Evaluation<D> provisional_cells<D>(                                                  \
      const dataflow::Network<D>&, std::span<const dataflow::Region<D>>, const RunOptions&, unsigned,     \
      const Recorded&, std::span<dataflow::Consumer* const>);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
