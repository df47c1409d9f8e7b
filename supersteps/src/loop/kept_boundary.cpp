#include "loop/kept_boundary.hpp"

#include <algorithm>
#include <utility>

#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "loop/progress.hpp"
#include "ranks/exchange.hpp"

namespace bsp2::supersteps {
namespace {

/// What the master reads; nothing where the boundary has to be found anew.
std::optional<TracedBoundary> read_boundary(const RunOptions& options, std::int32_t parts) {
  const io::SnapshotHead head = io::read_snapshot(*options.resume, io::SnapshotPart::head).head;
  const bool has_all = head.has_surface && (head.has_faces || !options.faces);
  if (!has_all || !head.complete || !are_same_limits(head, options)) return std::nullopt;
  auto surface = io::read_surface(*options.resume, parts, options.faces);
  return TracedBoundary{std::move(surface.value().triangles), std::move(surface->faces)};
}

}  // namespace

std::optional<TracedBoundary> kept_boundary(Ranks& ranks, const RunOptions& options, std::size_t parts) {
  if (!options.resume || !options.boundary || !options.collect_cells || options.contacts) return std::nullopt;
  std::optional<TracedBoundary> kept;
  ranks.agree([&] {
    if (ranks.is_master())
      kept = read_boundary(options, static_cast<std::int32_t>(std::max<std::size_t>(1, parts)));
  });
  bool is_kept = kept.has_value();
  if (ranks.count() > 1) broadcast(ranks, is_kept);
  if (is_kept && !kept) kept.emplace();
  return kept;
}

bool is_boundary_enough(const RunOptions& options) {
  return options.surface_only && !options.snapshot && !options.on_frame && options.points.empty();
}

void keep_boundary(Ranks& ranks, const RunOptions& options, unsigned step, RunResult& result) {
  const auto failed = attempt(ranks, [&] {
    ranks.agree([&] {
      ranks.begin("snapshot", step);
      if (!ranks.is_master() || !result.boundary) return;
      io::add_surface(*options.snapshot, *result.boundary, result.faces ? &*result.faces : nullptr);
    });
  });
  if (failed) result.report.warnings.push_back(failed->text);
}

}  // namespace bsp2::supersteps
