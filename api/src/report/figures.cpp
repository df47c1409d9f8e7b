#include "bsp2/api/report/report_json.hpp"

namespace bsp2::api {

Measures measures_of(const supersteps::Measures& found) {
  return {.volume = {found.in_volume, found.in_volume + found.fuzzy_volume},
          .centroid = found.centroid,
          .inertia = found.inertia,
          .inertia_least = found.inertia_least,
          .inertia_most = found.inertia_most};
}

std::vector<Part> parts_of(const supersteps::RunReport& report) {
  std::vector<Part> parts;
  for (const auto& part : report.named_parts)
    parts.push_back({part.part, part.name, part.colour, part.volume});
  return parts;
}

Figures figures_in(const supersteps::RunReport& report) {
  Figures figures{.model = report.model,
                  .dimension = report.dimension,
                  .ranks = report.ranks,
                  .threads = report.threads,
                  .regions = report.regions,
                  .level = report.level,
                  .primitives = report.primitives,
                  .hyperplanes = report.hyperplanes,
                  .has_cells = report.has_cells,
                  .in_cells = report.in_cells,
                  .fuzzy_cells = report.fuzzy_cells,
                  .out_cells = report.out_cells,
                  .in_volume = report.in_volume,
                  .fuzzy_volume = report.fuzzy_volume,
                  .measures = measures_of(report),
                  .parts = parts_of(report),
                  .tolerance = report.tolerance,
                  .angle = report.angle,
                  .eye = report.eye,
                  .lower = report.lower,
                  .upper = report.upper,
                  .digest = report.digest,
                  .is_complete = report.complete,
                  .is_interrupted = report.interrupted,
                  .splits = report.splits,
                  .predicates = report.predicates,
                  .exact_fallbacks = report.exact_fallbacks,
                  .seconds = report.seconds,
                  .cpu_seconds = report.cpu_seconds,
                  .peak_rss_bytes = report.peak_rss_bytes,
                  .warnings = report.warnings,
                  .notes = report.notes};
  for (const auto& each : report.measures) figures.named_measures.emplace_back(each.name, measures_of(each));
  if (const auto& boundary = report.boundary)
    figures.boundary = {boundary->triangles, boundary->area, boundary->closed, boundary->digest};
  if (const auto& simplices = report.simplices)
    figures.simplices = {simplices->simplices, simplices->smallest_angle, simplices->incomplete_cells,
                         simplices->left_out_volume};
  for (const auto& record : report.supersteps)
    figures.supersteps.push_back({record.name, record.step, record.seconds, record.work_seconds,
                                  record.hidden_seconds, record.bytes_sent, record.bytes_received,
                                  record.cells, record.hidden_bytes, record.predicted_seconds});
  for (const auto& failed : report.failed)
    figures.failed.push_back({failed.text, failed.is_users, failed.file});
  return figures;
}

}  // namespace bsp2::api
