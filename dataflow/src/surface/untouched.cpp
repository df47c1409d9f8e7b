#include "bsp2/dataflow/surface/untouched.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <variant>

#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::dataflow {
namespace {

using TrueSolid = geometry::RoundSolid;
using Vector = std::array<double, 3>;
using Frame = geometry::AffineMap<3>::Inverse;

/// How far rounded lengths that are equal may be apart, and the cosine of a right angle be from 0.
constexpr double rounding = 1e-12;

using geometry::dot;
double length(const Vector& a) { return std::sqrt(dot(a, a)); }
Vector unit(const Vector& a) { return {a[0] / length(a), a[1] / length(a), a[2] / length(a)}; }
bool are_equal(double a, double b) { return std::fabs(a - b) <= rounding * std::fabs(a); }
bool is_across(const Vector& a, const Vector& b) {
  return std::fabs(dot(a, b)) <= rounding * length(a) * length(b);
}

/// Whether circles around z are circles in the model, and what is across them stands upright on them.
bool keeps_circles(const Frame& frame) {
  const auto& [x, y, z] = frame.matrix;
  return is_across(x, y) && is_across(x, z) && is_across(y, z) && are_equal(length(x), length(y));
}

bool keeps_balls(const Frame& frame) {
  return keeps_circles(frame) && are_equal(length(frame.matrix[0]), length(frame.matrix[2]));
}

TrueSolid placed(decltype(TrueSolid::shape) shape, const Frame& frame, const Producer<3>& producer) {
  return {shape,         frame.origin,   unit(frame.matrix[0]), unit(frame.matrix[2]),
          producer.part, producer.lower, producer.upper};
}

std::optional<TrueSolid> true_solid(const Round<3>& round, const Producer<3>& producer) {
  const double radius = 1 / length(round.to_frame.matrix[0]);
  if (round.family.axes() == 3)
    return keeps_balls(round.to_frame)
               ? std::optional(placed(TrueSolid::Ball{radius}, round.to_frame, producer))
               : std::nullopt;
  if (!keeps_circles(round.to_frame)) return std::nullopt;
  const TrueSolid::Cone cone{radius * round.family.bottom(), radius * round.family.top(),
                             1 / length(round.to_frame.matrix[2])};
  return placed(cone, round.to_frame, producer);
}

std::optional<TrueSolid> true_solid(const Torus& torus, const Producer<3>& producer) {
  if (!keeps_balls(torus.to_frame) || !(torus.family.minor() < 1)) return std::nullopt;
  const double major = 1 / length(torus.to_frame.matrix[0]);
  return placed(TrueSolid::Torus{major, major * torus.family.minor()}, torus.to_frame, producer);
}

/// CAD files have no surface for it but splines.
std::optional<TrueSolid> true_solid(const Paraboloid<3>&, const Producer<3>&) { return std::nullopt; }

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

std::vector<TrueSolid> untouched_rounds(const Network<3>& network) {
  std::vector<TrueSolid> solids;
  if (network.rounds.empty()) return solids;
  const std::vector<bool> is_free = standing_free(network.producers);
  for (std::size_t i = 0; i < network.producers.size(); ++i) {
    const Producer<3>& producer = network.producers[i];
    if (producer.kind != ProducerKind::round || !is_free[i]) continue;
    if (producer.guard != -1 || !producer.owns || producer.is_empty()) continue;
    const auto solid = std::visit([&](const auto& round) { return true_solid(round, producer); },
                                  network.rounds[producer.index]);
    if (solid) solids.push_back(*solid);
  }
  return solids;
}

}  // namespace bsp2::dataflow
