#include "loop/tracing.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <string>
#include <utility>

#include "bsp2/dataflow/surface/surface.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "ranks/exchange.hpp"
#include "regions/progress_exchange.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {
namespace {

/// What the surface tells of the solid.
void measure(RunReport& report, const geometry::TriangleSurface& surface) {
  using Moments = geometry::Moments<3>;
  const Moments in = surface.moments();
  report.in_volume = in.volume();
  for (int i = 1; i <= 3 && in.volume() > 0; ++i)
    report.centroid.push_back(in.integral[Moments::index(0, i)] / in.volume());
  for (int i = 0; i <= 3; ++i) {
    std::vector<double> row;
    for (int j = 0; j <= 3; ++j) row.push_back(in.integral[Moments::index(i, j)]);
    report.inertia.push_back(std::move(row));
  }
  if (surface.points.empty()) return;
  report.lower.assign(3, std::numeric_limits<double>::infinity());
  report.upper.assign(3, -std::numeric_limits<double>::infinity());
  for (const auto& point : surface.points)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      report.lower[axis] = std::min(report.lower[axis], point[axis]);
      report.upper[axis] = std::max(report.upper[axis], point[axis]);
    }
}

/// This rank's share of the skin. If one rank cannot find its own, all end soon. Collective.
dataflow::TracedSurface share_of_surface(Ranks& ranks, dataflow::Network<3>& network,
                                         const RunOptions& options, unsigned threads) {
  const double share = 1.0 / ranks.count();
  ProgressExchange exchange(ranks, share, 0, {}, options.on_progress, nullptr);
  bool is_interrupted = false;
  dataflow::TracedSurface traced = dataflow::trace_surface(
      network, {.threads = threads,
                .share = static_cast<unsigned>(ranks.rank()),
                .shares = static_cast<unsigned>(ranks.count()),
                .interrupted =
                    [&] {
                      is_interrupted = is_interrupted || (options.interrupted && options.interrupted());
                      return is_interrupted || exchange.is_over();
                    },
                .on_progress = [&](double done) { exchange.progress(share * done, 0, 0); }});
  traced.interrupted = is_interrupted;
  if (is_interrupted || traced.has_given_up || traced.failure) exchange.end_all();
  exchange.finish();
  return traced;
}

}  // namespace

std::optional<TracedBoundary> trace_boundary(Ranks& ranks, dataflow::Network<3>& network,
                                             const RunOptions& options, unsigned threads) {
  constexpr double traced_share = 0.6;  // of the time
  ranks.agree([&] { ranks.begin("resolution"); });
  RunOptions traced_options = options;
  traced_options.interrupted = [&] {
    return geometry::Interruption::is_wanted() || (options.interrupted && options.interrupted());
  };
  if (options.on_progress)
    traced_options.on_progress = [&](double done, std::uint64_t) {
      options.on_progress(traced_share * done, 0);
    };
  auto traced = share_of_surface(ranks, network, traced_options, threads);
  const bool is_mine_found = !traced.has_given_up && !traced.failure && !traced.interrupted;
  const auto found = all_gather(ranks, static_cast<std::uint64_t>(is_mine_found));
  if (std::ranges::find(found, 0U) != found.end()) return std::nullopt;
  ranks.begin("resolution", 1);
  TracedBoundary result;
  find_boundary(ranks, network.table, std::move(traced.skin), options.faces, threads, result.boundary,
                result.faces, told_share(ranks, options, traced_share, 1));
  return result;
}

std::optional<RunResult> tracing(Ranks& ranks, dataflow::Network<3>& network, const RunOptions& options,
                                 const RunReport& before) {
  ranks.begin("computation", 0, Phase::computation);
  const std::size_t hyperplanes = network.table.size();
  dataflow::TracedSurface traced = share_of_surface(ranks, network, options, before.threads);
  ranks.agree([&] {
    if (traced.failure) std::rethrow_exception(traced.failure);
  });
  RunResult result;
  RunReport& report = result.report = before;
  report.has_cells = false;
  report.hyperplanes = hyperplanes;
  const std::vector<std::uint64_t> mine{traced.interrupted, traced.has_given_up, traced.regions};
  bool has_given_up = false;
  std::uint64_t regions = 0;
  for (const auto& share : all_gather(ranks, mine)) {
    report.interrupted = report.interrupted || share[0] != 0;
    has_given_up = has_given_up || share[1] != 0;
    regions += share[2];
  }
  report.regions = static_cast<unsigned>(regions);
  report.complete = !report.interrupted;
  if (report.interrupted) return result;
  if (has_given_up) return std::nullopt;
  ranks.begin("resolution");
  find_boundary(ranks, network.table, std::move(traced.skin), options.faces, before.threads, result.boundary,
                result.faces, told_share(ranks, options, 0, 1));
  if (result.boundary) measure(report, *result.boundary);
  return result;
}

}  // namespace bsp2::supersteps
