#include "bsp2/dataflow/surface/untouched.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace bsp2::dataflow {
namespace {

using geometry::RoundSolid;
using Vector = std::array<double, 3>;
using Frame = geometry::AffineMap<3>::Inverse;

/// How far rounded lengths that are equal may be apart, and the cosine of a right angle be from 0.
constexpr double rounding = 1e-12;

double inner(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vector& a) { return std::sqrt(inner(a, a)); }
Vector unit(const Vector& a) { return {a[0] / length(a), a[1] / length(a), a[2] / length(a)}; }
bool are_equal(double a, double b) { return std::fabs(a - b) <= rounding * std::fabs(a); }
bool is_across(const Vector& a, const Vector& b) {
  return std::fabs(inner(a, b)) <= rounding * length(a) * length(b);
}

/// Whether circles around z are circles in the model, and what is across them stands upright on them.
bool keeps_circles(const Frame& frame) {
  const auto& [x, y, z] = frame.matrix;
  return is_across(x, y) && is_across(x, z) && is_across(y, z) && are_equal(length(x), length(y));
}

bool keeps_balls(const Frame& frame) {
  return keeps_circles(frame) && are_equal(length(frame.matrix[0]), length(frame.matrix[2]));
}

RoundSolid placed(decltype(RoundSolid::shape) shape, const Frame& frame, const Producer<3>& producer) {
  return {shape,         frame.origin,   unit(frame.matrix[0]), unit(frame.matrix[2]),
          producer.part, producer.lower, producer.upper};
}

std::optional<RoundSolid> round_solid(const Network<3>& network, const Producer<3>& producer) {
  if (producer.kind == ProducerKind::torus) {
    const Torus& torus = network.tori[producer.index];
    if (!keeps_balls(torus.to_frame) || !(torus.family.minor() < 1)) return std::nullopt;
    const double major = 1 / length(torus.to_frame.matrix[0]);
    return placed(RoundSolid::Torus{major, major * torus.family.minor()}, torus.to_frame, producer);
  }
  const Round<3>& round = network.rounds[producer.index];
  const double radius = 1 / length(round.to_frame.matrix[0]);
  if (round.family.axes() == 3)
    return keeps_balls(round.to_frame)
               ? std::optional(placed(RoundSolid::Ball{radius}, round.to_frame, producer))
               : std::nullopt;
  if (!keeps_circles(round.to_frame)) return std::nullopt;
  const RoundSolid::Cone cone{radius * round.family.bottom(), radius * round.family.top(),
                              1 / length(round.to_frame.matrix[2])};
  return placed(cone, round.to_frame, producer);
}

/// Of each producer, whether its box misses all others. Only those that begin before it ends are looked at.
std::vector<bool> standing_free(const std::vector<Producer<3>>& producers) {
  std::vector<std::uint32_t> order(producers.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return producers[a].lower[0] < producers[b].lower[0]; });
  std::vector<bool> free(producers.size(), true);
  for (auto a = order.begin(); a != order.end(); ++a) {
    if (producers[*a].is_empty()) continue;
    for (auto b = a + 1; b != order.end() && producers[*b].lower[0] <= producers[*a].upper[0]; ++b)
      if (!producers[*b].is_empty() && !producers[*a].misses(producers[*b])) free[*a] = free[*b] = false;
  }
  return free;
}

}  // namespace

std::vector<RoundSolid> untouched_rounds(const Network<3>& network) {
  std::vector<RoundSolid> solids;
  if (network.rounds.empty() && network.tori.empty()) return solids;
  const std::vector<bool> is_free = standing_free(network.producers);
  for (std::size_t i = 0; i < network.producers.size(); ++i) {
    const Producer<3>& producer = network.producers[i];
    const bool is_round = producer.kind == ProducerKind::round || producer.kind == ProducerKind::torus;
    if (!is_round || !is_free[i] || producer.guard != -1 || !producer.owns || producer.is_empty()) continue;
    if (const auto solid = round_solid(network, producer)) solids.push_back(*solid);
  }
  return solids;
}

}  // namespace bsp2::dataflow
