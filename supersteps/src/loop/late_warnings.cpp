#include "loop/late_warnings.hpp"

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::supersteps {
namespace {

bool is_empty(const RunReport& report) {
  if (!report.has_cells) return report.complete && report.lower.empty();
  return report.complete && report.in_cells + report.fuzzy_cells == 0;
}

}  // namespace

std::string why_nothing_is_in(const RunReport& report) {
  if (report.fuzzy_cells == 0) return "the solid is empty";
  return counted(report.fuzzy_cells, "no cell is IN, what may be solid is in # FUZZY cell[s]; ") +
         (report.complete ? "a smaller tolerance or a higher level decides more"
                          : "the run is not complete, and going on decides more");
}

std::vector<std::string> late_warnings(const RunReport& report, const Source& source,
                                       const RunOptions& options) {
  std::vector<std::string> warnings;
  if (is_empty(report)) {
    // Merging may have emptied it.
    warnings.push_back(why_nothing_is_in(report) +
                       lost_by_merging(source, options, report.hyperplanes, report.threads));
  } else if (report.boundary && report.has_cells && report.complete && report.in_cells == 0) {
    warnings.push_back(why_nothing_is_in(report));
  }
  if (report.boundary && !report.boundary->closed)
    warnings.emplace_back(
        "the boundary is not closed: some of its edges are used more often in one direction than in the "
        "other, so its file has gaps, and programs "
        "that print it may fill it wrongly; cells, volume and pictures are not concerned. This is a mistake "
        "of bsp2: please report the model; another "
        "--coincidence, or --tolerance of a round one, may get around it");
  return warnings;
}

void refuse_late_warnings(Ranks& ranks, const RunReport& report, const Source& source,
                          const RunOptions& options) {
  std::vector<std::string> warnings;
  if (ranks.is_master()) warnings = late_warnings(report, source, options);
  broadcast(ranks, warnings);
  refuse_warnings(warnings);
}

}  // namespace bsp2::supersteps
