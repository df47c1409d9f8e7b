#include "loop/tracing.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "bsp2/dataflow/surface/surface.hpp"
#include "ranks/exchange.hpp"
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

}  // namespace

std::optional<RunResult> tracing(Ranks& ranks, const dataflow::Network<3>& network, const RunOptions& options,
                                 const RunReport& before) {
  ranks.begin("computation");
  dataflow::TracedSurface traced;
  ranks.agree([&] {
    traced = dataflow::trace_surface(network, {.threads = before.threads,
                                               .share = static_cast<unsigned>(ranks.rank()),
                                               .shares = static_cast<unsigned>(ranks.count()),
                                               .interrupted = options.interrupted,
                                               .on_progress = [&](double done) {
                                                 if (options.on_progress && ranks.is_master())
                                                   options.on_progress(done, 0);
                                               }});
  });
  RunResult result;
  RunReport& report = result.report = before;
  report.has_cells = false;
  report.hyperplanes = network.table.size();
  const std::vector<std::uint64_t> mine{traced.interrupted, traced.has_given_up, traced.regions};
  bool has_given_up = false;
  for (const auto& share : all_gather(ranks, mine)) {
    report.interrupted = report.interrupted || share[0] != 0;
    has_given_up = has_given_up || share[1] != 0;
    report.regions = static_cast<unsigned>(share[2]);
  }
  report.complete = !report.interrupted;
  if (report.interrupted) return result;
  if (has_given_up) return std::nullopt;
  ranks.begin("resolution");
  result.boundary = boundary_of(ranks, network.table, std::move(traced.skin));
  if (result.boundary) measure(report, *result.boundary);
  return result;
}

}  // namespace bsp2::supersteps
