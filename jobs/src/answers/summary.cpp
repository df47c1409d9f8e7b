#include "answers/summary.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ostream>
#include <string>
#include <tuple>

#include "bsp2/geometry/support/counted.hpp"
#include "tables/superstep_table.hpp"

namespace bsp2::jobs {
namespace {

using supersteps::RunReport;

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.0f} MiB", static_cast<double>(bytes) / (1 << 20));
}

std::string tuple(const std::vector<double>& values) {
  std::string text = "(";
  for (const double value : values)
    text += fmt::format("{}{:.6g}", text.size() > 1 ? ", " : "", value + 0.0);  // 0 for -0
  return text + ")";
}

void print_cells(std::ostream& out, const char* label, std::uint64_t cells, const std::string& volume) {
  out << fmt::format("  {:<10}{:>15} {:<6}  volume {}\n", label, grouped(cells), counted(cells, "cell[s]"),
                     volume);
}

/// Found by this session, or by those before it and this one.
std::uint64_t cells_a_second(const RunReport& report) {
  const std::uint64_t cells = report.in_cells + report.fuzzy_cells + report.out_cells.value_or(0);
  return report.seconds > 0 ? static_cast<std::uint64_t>(static_cast<double>(cells) / report.seconds) : 0;
}

/// Between which values the moments are; the volume is the entry of 1 and 1.
void print_moments(std::ostream& out, const supersteps::Measures& measures) {
  const auto& [least, most] = std::tie(measures.inertia_least, measures.inertia_most);
  for (std::size_t i = 0; i < least.size(); ++i)
    for (std::size_t j = std::max<std::size_t>(i, 1); j < least.size(); ++j) {
      const std::string of = i == 0 ? fmt::format("x{}", j) : fmt::format("x{} x{}", i, j);
      out << fmt::format("  {:<10}{:<6} {:.6g} to {:.6g}\n", i == 0 && j < 2 ? "integrals" : "", of,
                         least[i][j], most[i][j]);
    }
}

void print_measures(std::ostream& out, const supersteps::NamedMeasures& measures) {
  out << fmt::format("  measure   {}: volume {:.12g}", measures.name, measures.in_volume);
  if (measures.fuzzy_volume > 0)
    out << fmt::format(" to {:.12g}", measures.in_volume + measures.fuzzy_volume);
  if (!measures.centroid.empty()) out << ", centroid " << tuple(measures.centroid);
  out << '\n';
  print_moments(out, measures);
}

}  // namespace

bool needs_table(const RunReport& report) {
  constexpr double long_seconds = 10;
  return report.ranks > 1 || report.seconds > long_seconds;
}

std::string simplex_name(const RunReport& report) {
  return report.dimension == 3 ? "tetrahedra" : "triangles";
}

namespace {

std::string counted_simplices(const RunReport& report) {
  const std::uint64_t count = report.simplices->simplices;
  return report.dimension == 3 ? counted(count, "# tetrahedr[on|a]") : counted(count, "# triangle[s]");
}

void print_simplices(std::ostream& out, const RunReport& report) {
  const auto& simplices = *report.simplices;
  out << fmt::format("  tets      {}", counted_simplices(report));
  if (simplices.simplices > 0)
    out << fmt::format(", smallest {}angle {:.3g} degrees", report.dimension == 3 ? "dihedral " : "",
                       simplices.smallest_angle);
  out << '\n';
  if (simplices.incomplete_cells > 0)
    out << fmt::format("            left out, flat in doubles: of {}, volume {:.3g}\n",
                       counted(simplices.incomplete_cells, "# cell[s]"), simplices.left_out_volume);
}

}  // namespace

void print_summary(std::ostream& out, const RunReport& report, bool with_table) {
  out << report.model << '\n'
      << fmt::format("  {}, {}, {}\n", counted(report.primitives, "# primitive[s]"),
                     counted(report.hyperplanes, "# hyperplane[s]"), counted(report.regions, "# region[s]"))
      << fmt::format("  {}, {}\n\n", counted(report.ranks, "# rank[s]"),
                     counted(report.threads, "# thread[s]") + (report.ranks > 1 ? " each" : ""));
  if (report.has_cells) {
    print_cells(out, "IN", report.in_cells, fmt::format("{:.12g}", report.in_volume));
    print_cells(out, "FUZZY", report.fuzzy_cells, fmt::format("{:.12g}", report.fuzzy_volume));
  } else {
    out << fmt::format("  {:<10}{:>15} cells   volume {:.12g}\n", "solid", "without", report.in_volume);
  }
  if (report.fuzzy_volume > 0)
    out << fmt::format("  {:<10}{:>21}   volume {:.12g} to {:.12g}\n", "solid", "", report.in_volume,
                       report.in_volume + report.fuzzy_volume);
  if (!report.complete)
    out << "  ended before all was decided: FUZZY cells hold what is not\n";
  else if (report.tolerance)
    out << fmt::format("  round surfaces are in FUZZY cells thinner than {:.6g}\n", *report.tolerance);
  if (report.complete && report.angle)
    out << fmt::format("  or seen thinner than {:.6g} degrees from ({:.6g})\n", *report.angle,
                       fmt::join(report.eye, ", "));
  if (report.out_cells) print_cells(out, "OUT", *report.out_cells, "not summed");
  if (!report.centroid.empty()) out << "  centroid  " << tuple(report.centroid) << '\n';
  print_moments(out, report);
  for (const auto& measures : report.measures) print_measures(out, measures);
  for (const auto& part : report.named_parts)
    out << fmt::format("  part      {}: {}, volume {:.12g}\n", part.part, part.name, part.volume);
  if (!report.lower.empty())
    out << "  bounds    " << tuple(report.lower) << "\n            " << tuple(report.upper) << '\n';
  if (report.boundary) {
    out << fmt::format("  boundary  {}, area {:.12g}, {}\n",
                       counted(report.boundary->triangles, "# triangle[s]"), report.boundary->area,
                       report.boundary->closed ? "closed" : "NOT closed");
  }
  if (report.simplices) print_simplices(out, report);
  if (report.has_cells) out << "  digest    " << report.digest << '\n';
  if (report.boundary) out << "  surface   " << report.boundary->digest << '\n';
  out << '\n';
  if (with_table) {
    print_supersteps(out, report.supersteps);
    out << '\n';
  }
  out << fmt::format("  {:.2f} s, {:.2f} s of CPU, at most {} of memory", report.seconds, report.cpu_seconds,
                     mebibytes(report.peak_rss_bytes));
  if (report.has_cells) out << ", " << counted(cells_a_second(report), "# cell[s]") << " a second";
  out << '\n';
}

void print_stats(std::ostream& out, const RunReport& report) {
  const auto share = [](std::uint64_t part, double whole) {
    return whole > 0 ? static_cast<double>(part) / whole : 0.0;
  };
  const auto line = [&](const char* label, const std::string& value, const std::string& note = "") {
    out << fmt::format("  {:<18}{:>18}{}\n", label, value, note);
  };
  out << '\n';
  if (!report.has_cells) {  // nothing was split
    line("peak memory", mebibytes(report.peak_rss_bytes));
    return;
  }
  line("splits", grouped(report.splits));
  line("predicates", grouped(report.predicates));
  line("exact fallbacks", grouped(report.exact_fallbacks),
       fmt::format("  ({:.4f} % of the predicates)",
                   100 * share(report.exact_fallbacks, static_cast<double>(report.predicates))));
  line("cells a second", grouped(cells_a_second(report)));
  line("peak memory", mebibytes(report.peak_rss_bytes));
}

}  // namespace bsp2::jobs
