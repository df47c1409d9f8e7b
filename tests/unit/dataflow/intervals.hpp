#pragma once

// Solids with curved surfaces: intervals that hold the truth, and cells that do not depend on threads and
// order.

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {

/// The volume is between `in` and `high()`.
struct VolumeInterval {
  double in, fuzzy;
  std::uint64_t cells;
  [[nodiscard]] double high() const { return in + fuzzy; }
};

inline EvaluateOptions down_to(unsigned level) {
  EvaluateOptions options;
  options.level = level;
  return options;
}
inline EvaluateOptions thinner_than(double tolerance) {
  EvaluateOptions options;
  options.tolerance = tolerance;
  return options;
}

template <int D>
VolumeInterval volume_interval(const model::Expression& e, const EvaluateOptions& options) {
  const Network<D> network = compile<D>(e, {});
  const auto totals = evaluate(network, partition(network, 0).regions, options, {}).totals;
  return {totals.in.value().volume(), totals.fuzzy.value().volume(), totals.in_cells + totals.fuzzy_cells};
}

inline void expect_contains(const VolumeInterval& interval, double truth) {
  EXPECT_LE(interval.in, truth * (1 + 1e-12));
  EXPECT_GE(interval.high(), truth * (1 - 1e-12));
}

/// Expects one digest of 1, 2 and 4 threads, in both orders.
template <int D>
void expect_same_digest(const model::Expression& e, EvaluateOptions options, unsigned depth) {
  std::set<std::string> digests;
  std::uint64_t cells = 0;
  for (const unsigned threads : {1U, 2U, 4U})
    for (const Order order : {Order::depth, Order::priority}) {
      const Network<D> network = compile<D>(e, {});  // anew: patches of splines are halved by a run
      options.threads = threads;
      options.order = order;
      const auto evaluation = evaluate(network, partition(network, depth).regions, options, {});
      digests.insert(evaluation.totals.digest.hex());
      cells = evaluation.totals.in_cells + evaluation.totals.fuzzy_cells;
    }
  EXPECT_EQ(digests.size(), 1U);
  EXPECT_GT(cells, 10U);
}

}  // namespace bsp2::dataflow
