#include "bsp2/dataflow/evaluate/evaluate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/threads.hpp"
#include "evaluate/assembling.hpp"
#include "evaluate/evaluation_context.hpp"
#include "evaluate/large_stack.hpp"

namespace bsp2::dataflow {

using Clock = std::chrono::steady_clock;

template <int D>
void Totals<D>::reset_bounds() {
  lower.fill(std::numeric_limits<double>::infinity());
  upper.fill(-std::numeric_limits<double>::infinity());
}

template <int D>
geometry::MomentSum<D>& Totals<D>::of_part(std::size_t part) {
  if (part >= parts.size()) {
    geometry::MomentSum<D> nothing = in;
    auto state = nothing.state();
    state.words = {};
    nothing.set_state(state);
    parts.resize(part + 1, nothing);
  }
  return parts[part];
}

template <int D>
Totals<D>& Totals<D>::operator+=(const Totals& other) {
  in += other.in;
  for (std::size_t part = 0; part < other.parts.size(); ++part) of_part(part) += other.parts[part];
  fuzzy += other.fuzzy;
  fuzzy_below += other.fuzzy_below;
  in_cells += other.in_cells;
  fuzzy_cells += other.fuzzy_cells;
  out_cells += other.out_cells;
  for (int i = 0; i < D; ++i) {
    lower[i] = std::min(lower[i], other.lower[i]);
    upper[i] = std::max(upper[i], other.upper[i]);
  }
  level = std::max(level, other.level);
  digest += other.digest;
  counts += other.counts;
  return *this;
}

namespace {

/// The time since the start but for what the worker that did most of it took to make the cells of frontiers
/// again: short steps would do nothing else.
template <int D>
double seconds_of_work(const EvaluationContext<D>& context, Clock::time_point start) {
  std::int64_t unfolding = 0;
  for (const auto& worker : context.workers)
    unfolding = std::max(unfolding, worker->unfolding.load(std::memory_order_relaxed));
  return std::chrono::duration<double>(Clock::now() - start - std::chrono::nanoseconds(unfolding)).count();
}

/// How long to wait for what the consumers are served, at most: not much beyond the budget.
template <int D>
std::chrono::milliseconds patience(const EvaluationContext<D>& context, Clock::time_point start) {
  constexpr std::chrono::milliseconds shortest(1), longest(20);
  if (context.stop || !context.options.budget_seconds) return longest;
  const std::chrono::duration<double> left(*context.options.budget_seconds - seconds_of_work(context, start));
  if (left > longest) return longest;
  return std::clamp(std::chrono::ceil<std::chrono::milliseconds>(left), shortest, longest);
}

/// Whether the time is over, for which something has been done at least.
template <int D>
bool is_over(const EvaluationContext<D>& context, Clock::time_point start) {
  return context.options.budget_seconds && context.fired &&
         seconds_of_work(context, start) > *context.options.budget_seconds;
}

/// The thread that called `evaluate`: serves the consumers and watches the budget.
template <int D>
void serve(EvaluationContext<D>& context, std::span<Consumer* const> consumers) {
  const auto start = Clock::now();
  auto last_progress = start;
  const auto look_around = [&] {
    const auto now = Clock::now();
    std::uint64_t cells = 0;
    double decided = 0;
    for (const auto& worker : context.workers) {
      cells += worker->decided_cells.load(std::memory_order_relaxed);
      decided += std::ldexp(static_cast<double>(worker->decided.load(std::memory_order_relaxed)), -60);
    }
    if (is_over(context, start)) context.stop = true;
    if (context.options.interrupted && context.options.interrupted()) context.stop = true;
    if (now - last_progress > std::chrono::milliseconds(100)) {
      last_progress = now;
      for (Consumer* consumer : consumers)
        consumer->progress(std::min(1.0, decided), cells, context.grown.load(std::memory_order_relaxed));
    }
  };
  for (;;) {
    const bool all_done =
        context.running.load() == 0;  // before the look into the queue: nothing comes after it
    for (auto& refinement :
         context.queue.pop_all(all_done ? std::chrono::milliseconds(0) : patience(context, start))) {
      for (Consumer* consumer : consumers) consumer->consume(refinement);
      refinement.reset();  // the others may be many
      look_around();
    }
    if (all_done) return;
    look_around();
  }
}

/// The first tokens, one a region, dealt out to the workers.
template <int D>
void deal(EvaluationContext<D>& context, std::vector<Region<D>> regions) {
  context.region_codes.assign(regions.size(), 0);
  context.suspended.resize(regions.size());
  context.is_left.resize(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    Region<D>& region = regions[i];
    Token<D>* token = context.first_tokens.take();
    token->cell = std::move(region.cell);
    token->program.assign(region.program);
    token->region = static_cast<std::uint32_t>(i);
    token->level = region.level;
    if (!region.frontier.empty()) token->restored = 0;
    if (!context.options.same_limits)
      for (Frontier::Node& node : region.frontier.nodes) node.ended = 0;
    context.region_numbers.push_back(region.number);
    context.frontiers.emplace_back(std::move(region.frontier));
    context.workers[i % context.workers.size()]->add(token);
  }
  context.open_regions = regions.size();
}

template <int D>
Evaluation<D> run_crew(const Network<D>& network, std::vector<Region<D>> regions,
                       const EvaluateOptions& options, std::span<Consumer* const> consumers, bool refine) {
  EvaluationContext<D> context(network, options,
                               std::any_of(consumers.begin(), consumers.end(),
                                           [](const Consumer* consumer) { return consumer->takes_cells(); }));
  context.stop = !refine;
  deal(context, std::move(regions));
  context.running = static_cast<unsigned>(context.workers.size());
  using Begin = geometry::Threads::Begin;
  geometry::Threads threads;
  try {
    for (std::size_t i = context.workers.size();
         i-- > 0;)  // the one that begins here last: it takes the processor
      threads.start([&worker = *context.workers[i]] { worker.run(); },
                    i == 0 ? Begin::here : Begin::elsewhere, large_stack_bytes);
    serve(context, consumers);
  } catch (...) {
    context.fail();
  }
  threads.join();
  context.rethrow();

  Evaluation<D> result{
      Totals<D>(network.table.radius(), network.table.width()), {}, {}, {}, {}, context.stop};
  result.totals.reset_bounds();
  for (const auto& worker : context.workers) result.totals += worker->totals;
  assemble(context, result);
  return result;
}

}  // namespace

template <int D>
Evaluation<D> evaluate(const Network<D>& network, std::vector<Region<D>> regions,
                       const EvaluateOptions& options, std::span<Consumer* const> consumers) {
  return run_crew(network, std::move(regions), options, consumers, true);
}

template <int D>
Evaluation<D> picture(const Network<D>& network, std::span<const Region<D>> regions, EvaluateOptions options,
                      std::span<Consumer* const> consumers) {
  std::vector<Region<D>> copies;
  for (const Region<D>& region : regions) copies.push_back(region.copy());
  options.suspend = options.hold_uniform_regions = false;
  return run_crew(network, std::move(copies), options, consumers, false);
}

#define BSP2_INSTANTIATE(D)                                                                             \
  template struct Totals<D>;                                                                            \
  template Evaluation<D> evaluate<D>(const Network<D>&, std::vector<Region<D>>, const EvaluateOptions&, \
                                     std::span<Consumer* const>);                                       \
  template Evaluation<D> picture<D>(const Network<D>&, std::span<const Region<D>>, EvaluateOptions,     \
                                    std::span<Consumer* const>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
