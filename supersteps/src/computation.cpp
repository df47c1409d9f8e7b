#include <cmath>

#include "contact.hpp"
#include "instantiate.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

template <int D>
dataflow::Evaluation<D> computation(Ranks& ranks, const dataflow::Network<D>& network, std::vector<dataflow::Region<D>> regions,
                                    const RunOptions& options, unsigned threads, std::span<dataflow::Consumer* const> consumers) {
  dataflow::EvaluateOptions evaluate;
  evaluate.threads = threads;
  evaluate.order = options.order == Order::priority ? dataflow::Order::priority : dataflow::Order::depth;
  evaluate.level = options.level;
  evaluate.budget_seconds = options.budget_seconds;
  evaluate.cells = options.cells;
  evaluate.keep_in = options.keep_in;
  evaluate.keep_fuzzy = options.keep_fuzzy;
  evaluate.keep_out = options.keep_out;
  evaluate.record_tree = options.collect_cells;

  double share = 0;  // of space
  for (const auto& region : regions) share += std::ldexp(1.0, -int{region.level});
  Contact contact(ranks, share, options.on_progress);
  std::vector<dataflow::Consumer*> all(consumers.begin(), consumers.end());
  all.push_back(&contact);
  auto evaluation = dataflow::evaluate(network, std::move(regions), evaluate, all);
  contact.finish();
  return evaluation;
}

#define BSP2_STAGE(D)                                                                                                     \
  template dataflow::Evaluation<D> computation<D>(Ranks&, const dataflow::Network<D>&, std::vector<dataflow::Region<D>>,  \
                                                  const RunOptions&, unsigned, std::span<dataflow::Consumer* const>);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
