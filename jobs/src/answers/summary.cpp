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
std::uint64_t cells_a_second(const Figures& figures) {
  const std::uint64_t cells = figures.in_cells + figures.fuzzy_cells + figures.out_cells.value_or(0);
  return figures.seconds > 0 ? static_cast<std::uint64_t>(static_cast<double>(cells) / figures.seconds) : 0;
}

/// Between which values the moments are; the volume is the entry of 1 and 1.
void print_moments(std::ostream& out, const Measures& measures) {
  const auto& [least, most] = std::tie(measures.inertia_least, measures.inertia_most);
  for (std::size_t i = 0; i < least.size(); ++i)
    for (std::size_t j = std::max<std::size_t>(i, 1); j < least.size(); ++j) {
      const std::string of = i == 0 ? fmt::format("x{}", j) : fmt::format("x{} x{}", i, j);
      out << fmt::format("  {:<10}{:<6} {:.6g} to {:.6g}\n", i == 0 && j < 2 ? "integrals" : "", of,
                         least[i][j], most[i][j]);
    }
}

void print_measures(std::ostream& out, const std::string& name, const Measures& measures) {
  out << fmt::format("  measure   {}: volume {:.12g}", name, measures.volume.least);
  if (measures.volume.most > measures.volume.least) out << fmt::format(" to {:.12g}", measures.volume.most);
  if (!measures.centroid.empty()) out << ", centroid " << tuple(measures.centroid);
  out << '\n';
  print_moments(out, measures);
}

}  // namespace

bool needs_table(const Figures& figures) {
  constexpr double long_seconds = 10;
  return figures.ranks > 1 || figures.seconds > long_seconds;
}

namespace {

std::string counted_simplices(const Figures& figures) {
  const std::uint64_t count = figures.simplices->count;
  return figures.dimension == 3 ? counted(count, "# tetrahedr[on|a]") : counted(count, "# triangle[s]");
}

void print_simplices(std::ostream& out, const Figures& figures) {
  const auto& simplices = *figures.simplices;
  out << fmt::format("  tets      {}", counted_simplices(figures));
  if (simplices.count > 0)
    out << fmt::format(", smallest {}angle {:.3g} degrees", figures.dimension == 3 ? "dihedral " : "",
                       simplices.smallest_angle);
  out << '\n';
  if (simplices.incomplete_cells > 0)
    out << fmt::format("            left out, flat in doubles: of {}, volume {:.3g}\n",
                       counted(simplices.incomplete_cells, "# cell[s]"), simplices.left_out_volume);
}

}  // namespace

void print_summary(std::ostream& out, const Figures& figures, bool with_table) {
  out << figures.model << '\n'
      << fmt::format("  {}, {}, {}\n", counted(figures.primitives, "# primitive[s]"),
                     counted(figures.hyperplanes, "# hyperplane[s]"), counted(figures.regions, "# region[s]"))
      << fmt::format("  {}, {}\n\n", counted(figures.ranks, "# rank[s]"),
                     counted(figures.threads, "# thread[s]") + (figures.ranks > 1 ? " each" : ""));
  if (figures.has_cells) {
    print_cells(out, "IN", figures.in_cells, fmt::format("{:.12g}", figures.in_volume));
    print_cells(out, "FUZZY", figures.fuzzy_cells, fmt::format("{:.12g}", figures.fuzzy_volume));
  } else {
    out << fmt::format("  {:<10}{:>15} cells   volume {:.12g}\n", "solid", "without", figures.in_volume);
  }
  if (figures.fuzzy_volume > 0)
    out << fmt::format("  {:<10}{:>21}   volume {:.12g} to {:.12g}\n", "solid", "", figures.in_volume,
                       figures.in_volume + figures.fuzzy_volume);
  if (!figures.is_complete)
    out << "  ended before all was decided: FUZZY cells hold what is not\n";
  else if (figures.tolerance)
    out << fmt::format("  round surfaces are in FUZZY cells thinner than {:.6g}\n", *figures.tolerance);
  if (figures.is_complete && figures.angle)
    out << fmt::format("  or seen thinner than {:.6g} degrees from ({:.6g})\n", *figures.angle,
                       fmt::join(figures.eye, ", "));
  if (figures.out_cells) print_cells(out, "OUT", *figures.out_cells, "not summed");
  if (!figures.measures.centroid.empty()) out << "  centroid  " << tuple(figures.measures.centroid) << '\n';
  print_moments(out, figures.measures);
  for (const auto& [name, measures] : figures.named_measures) print_measures(out, name, measures);
  for (const auto& part : figures.parts)
    out << fmt::format("  part      {}: {}, volume {:.12g}\n", part.number, part.name, part.volume);
  if (!figures.lower.empty())
    out << "  bounds    " << tuple(figures.lower) << "\n            " << tuple(figures.upper) << '\n';
  if (figures.boundary) {
    out << fmt::format("  boundary  {}, area {:.12g}, {}\n",
                       counted(figures.boundary->triangles, "# triangle[s]"), figures.boundary->area,
                       figures.boundary->closed ? "closed" : "NOT closed");
  }
  if (figures.simplices) print_simplices(out, figures);
  if (figures.has_cells) out << "  digest    " << figures.digest << '\n';
  if (figures.boundary) out << "  surface   " << figures.boundary->digest << '\n';
  out << '\n';
  if (with_table) {
    print_supersteps(out, figures.supersteps);
    out << '\n';
  }
  out << fmt::format("  {:.2f} s, {:.2f} s of CPU, at most {} of memory", figures.seconds,
                     figures.cpu_seconds, mebibytes(figures.peak_rss_bytes));
  if (figures.has_cells) out << ", " << counted(cells_a_second(figures), "# cell[s]") << " a second";
  out << '\n';
}

void print_stats(std::ostream& out, const Figures& figures) {
  const auto share = [](std::uint64_t part, double whole) {
    return whole > 0 ? static_cast<double>(part) / whole : 0.0;
  };
  const auto line = [&](const char* label, const std::string& value, const std::string& note = "") {
    out << fmt::format("  {:<18}{:>18}{}\n", label, value, note);
  };
  out << '\n';
  if (!figures.has_cells) {  // nothing was split
    line("peak memory", mebibytes(figures.peak_rss_bytes));
    return;
  }
  line("splits", grouped(figures.splits));
  line("predicates", grouped(figures.predicates));
  line("exact fallbacks", grouped(figures.exact_fallbacks),
       fmt::format("  ({:.4f} % of the predicates)",
                   100 * share(figures.exact_fallbacks, static_cast<double>(figures.predicates))));
  line("cells a second", grouped(cells_a_second(figures)));
  line("peak memory", mebibytes(figures.peak_rss_bytes));
}

}  // namespace bsp2::jobs
