#include "tables/node_tables.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ostream>
#include <string>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {
namespace {

std::string name_of(const ClusterTable& resolved) {
  return resolved.level ? "level " + std::to_string(*resolved.level) : "to the end";
}

std::vector<double> sorted_seconds(const std::vector<NodeFigures>& nodes) {
  std::vector<double> seconds;
  for (const NodeFigures& node : nodes) seconds.push_back(node.seconds);
  std::sort(seconds.begin(), seconds.end());
  return seconds;
}

NodeFigures sum_of(const std::vector<NodeFigures>& nodes) {
  NodeFigures sum;
  for (const NodeFigures& node : nodes) {
    sum.cells += node.cells;
    sum.facets += node.facets;
    sum.splits += node.splits;
    sum.predicates += node.predicates;
    sum.seconds += node.seconds;
  }
  return sum;
}

/// Of a count: the most of a node over the mean.
double imbalance(const std::vector<NodeFigures>& nodes, std::uint64_t NodeFigures::*count) {
  std::uint64_t most = 0;
  for (const NodeFigures& node : nodes) most = std::max(most, node.*count);
  const auto sum = sum_of(nodes).*count;
  return sum == 0 ? 1
                  : static_cast<double>(most) * static_cast<double>(nodes.size()) / static_cast<double>(sum);
}

/// The time of one node over that of so many, all of which wait for the slowest one.
double efficiency(const ClusterTable& finest, const std::vector<NodeFigures>& nodes) {
  return finest.nodes.front().front().seconds /
         (static_cast<double>(nodes.size()) * sorted_seconds(nodes).back());
}

/// Table 1, at the finest resolution.
void print_run_times(std::ostream& out, const ClusterTable& finest) {
  out << "Table 1: run times in seconds, " << name_of(finest) << ", " << finest.regions
      << " regions\n\n  nodes       ";
  for (const auto& nodes : finest.nodes) out << fmt::format(" {:>9}", nodes.size());
  const auto row = [&](const char* name, auto value, int digits = 3) {
    out << fmt::format("\n  {:<12}", name);
    for (const auto& nodes : finest.nodes) out << fmt::format(" {:>9.{}f}", value(nodes), digits);
  };
  row(
      "max", [](const auto& nodes) { return sorted_seconds(nodes).back(); }, 4);
  row(
      "median", [](const auto& nodes) { return sorted_seconds(nodes)[nodes.size() / 2]; }, 4);
  row(
      "min", [](const auto& nodes) { return sorted_seconds(nodes).front(); }, 4);
  row(
      "sum", [](const auto& nodes) { return sum_of(nodes).seconds; }, 4);
  row("max/mean", [](const auto& nodes) {
    return sorted_seconds(nodes).back() * static_cast<double>(nodes.size()) / sum_of(nodes).seconds;
  });
  if (finest.nodes.front().size() == 1)
    row("efficiency", [&](const auto& nodes) { return efficiency(finest, nodes); });
  const auto rows_of_count = [&](const char* name, std::uint64_t NodeFigures::*count, double unit) {
    row(
        name, [=](const auto& nodes) { return static_cast<double>(sum_of(nodes).*count) / unit; }, 1);
    row("max/mean", [=](const auto& nodes) { return imbalance(nodes, count); });
  };
  rows_of_count("10^3 splits", &NodeFigures::splits, 1e3);
  rows_of_count("10^6 sides", &NodeFigures::predicates, 1e6);
  out << fmt::format("\n  {:<12}", "distribution");
  for (const double seconds : finest.distribution_seconds) out << fmt::format(" {:>9.4f}", seconds);
  out << "\n\n";
}

/// Digits in groups, but of a million and more, so that three resolutions fit into 80 columns.
std::string short_of(std::uint64_t count) {
  return count < 1'000'000 ? grouped(count) : std::to_string(count);
}

void print_row(std::ostream& out, const std::string& name, const std::vector<NodeFigures>& figures) {
  out << fmt::format("{:<5}", name);
  for (const NodeFigures& node : figures)
    out << fmt::format("{:>9}{:>9}{:>7.3f}", short_of(node.cells), short_of(node.facets), node.seconds);
  out << '\n';
}

/// Tables 2 to 6: the nodes of one number of them, at all resolutions.
void print_nodes(std::ostream& out, const std::vector<ClusterTable>& measured, std::size_t index) {
  const std::size_t count = measured.front().nodes[index].size();
  out << fmt::format("Table {}: model resolution and run times, number of nodes n = {}\n\n{:<5}", index + 2,
                     count, "");
  for (const ClusterTable& resolved : measured) out << fmt::format("{:>25}", name_of(resolved));
  out << fmt::format("\n{:<5}", "Node");
  for (std::size_t i = 0; i < measured.size(); ++i)
    out << fmt::format("{:>9}{:>9}{:>7}", "3-cells", "2-cells", "Sec");
  out << '\n';
  for (std::size_t node = 0; node < count; ++node) {
    std::vector<NodeFigures> figures;
    for (const ClusterTable& resolved : measured) figures.push_back(resolved.nodes[index][node]);
    print_row(out, std::to_string(node + 1), figures);
  }
  std::vector<NodeFigures> last;
  for (const ClusterTable& resolved : measured) {
    last.push_back(sum_of(resolved.nodes[index]));
    last.back().seconds /= static_cast<double>(count);
  }
  print_row(out, "", last);
  out << '\n';
}

}  // namespace

void print_tables(std::ostream& out, const std::vector<ClusterTable>& measured, bool brief) {
  out << "Every node's figures are measured here, one node after the other, as on a\n"
         "cluster of such machines; nothing ran in parallel but the threads of a node.\n"
         "Seconds are of processor time for each thread, the least of up to five times.\n"
         "Efficiency: that of one node / (nodes x max). Splits of cells, and questions on\n"
         "which side of a plane a point is, count the work whatever else the machine does.\n"
         "Distribution: to find a node's part of the regions, on one thread; the most of\n"
         "up to eight nodes.\n";
  if (!brief) out << "2-cells are those of a node's boundary. Last row: sums of cells, mean seconds.\n";
  out << '\n';
  print_run_times(out, measured.back());
  for (std::size_t i = 0; i < measured.front().nodes.size() && !brief; ++i) print_nodes(out, measured, i);
}

void print_surface_table(std::ostream& out, const std::vector<SurfaceTable>& measured) {
  out << "The surface, found without cells: every node's part is measured here, one node\n"
         "after the other, as on a cluster of such machines. Seconds are of processor time\n"
         "for each thread, the least of three times. Where nodes wait for each other, the\n"
         "slowest one counts: max is the sum of that over all steps. Efficiency: all that\n"
         "one node takes / (nodes x max), without and with the master's list of triangles.\n\n";
  out << fmt::format("{}\n\n  nodes             ", counted(measured.front().triangles, "# triangle[s]"));
  for (const SurfaceTable& table : measured) out << fmt::format(" {:>9}", table.nodes);
  const auto row = [&](const char* name, auto value, int digits = 4) {
    out << fmt::format("\n  {:<18}", name);
    for (const SurfaceTable& table : measured) out << fmt::format(" {:>9.{}f}", value(table), digits);
  };
  row("tracing, mean", [](const SurfaceTable& table) { return table.tracing; });
  row("tracing, max", [](const SurfaceTable& table) { return table.slowest_tracing; });
  row("resolution, mean", [](const SurfaceTable& table) { return table.resolution; });
  row("resolution, max", [](const SurfaceTable& table) { return table.slowest_resolution; });
  row("list, master", [](const SurfaceTable& table) { return table.joining; });
  if (measured.front().nodes == 1) {
    const double alone = measured.front().tracing + measured.front().resolution;
    const auto efficiency = [&](const SurfaceTable& table, double more) {
      return alone / (table.nodes * (table.slowest_tracing + table.slowest_resolution + more));
    };
    row(
        "efficiency", [&](const SurfaceTable& table) { return efficiency(table, 0); }, 3);
    row(
        "with the list", [&](const SurfaceTable& table) { return efficiency(table, table.joining); }, 3);
  }
  out << "\n\n";
}

}  // namespace bsp2::jobs
