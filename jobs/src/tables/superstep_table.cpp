#include "tables/superstep_table.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <numeric>
#include <ostream>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {
namespace {

/// Six digits of bytes, or what comes near.
std::string bytes_text(std::uint64_t bytes) {
  if (bytes < 1000000) return grouped(bytes) + " B";
  if (bytes < 1000000000) return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
  return fmt::format("{:.1f} GB", 1e-9 * static_cast<double>(bytes));
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// The largest h-relation of a rank.
std::uint64_t h_of(const Superstep& record) {
  std::uint64_t h = 0;
  for (const auto* bytes : {&record.bytes_sent, &record.bytes_received})
    for (const std::uint64_t value : *bytes) h = std::max(h, value);
  return h;
}

/// What of it travelled while workers computed.
std::uint64_t hidden_of(const Superstep& record) {
  const std::uint64_t hidden =
      record.hidden_bytes.empty() ? 0
                                  : *std::max_element(record.hidden_bytes.begin(), record.hidden_bytes.end());
  return std::min(hidden, h_of(record));
}

void print_record(std::ostream& out, const Superstep& record) {
  const auto [least, most] = std::minmax_element(record.work_seconds.begin(), record.work_seconds.end());
  out << fmt::format("  {:<12}{:>4}{:>8.3f}{:>8.3f}{:>8.3f}{:>10}{:>11}{:>8.3f}{:>8.3f}\n", record.name,
                     record.step, *least, median(record.work_seconds), *most, bytes_text(h_of(record)),
                     grouped(std::accumulate(record.cells.begin(), record.cells.end(), std::uint64_t{0})),
                     *std::max_element(record.seconds.begin(), record.seconds.end()),
                     record.predicted_seconds);
}

/// A run that is resumed begins with this, as the first one did.
bool begins_session(const Superstep& record) { return record.name == "compilation"; }

}  // namespace

void print_supersteps(std::ostream& out, const std::vector<Superstep>& records) {
  out << fmt::format("  {:<12}{:>4}{:>8}{:>8}{:>8}{:>10}{:>11}{:>8}{:>8}\n", "superstep", "step", "w min",
                     "median", "max", "h", "cells", "seconds", "w+gh+l");
  double hidden = 0, waited = 0;  // on all ranks together
  std::uint64_t h = 0, hidden_h = 0;
  std::size_t ranks = 0;
  const bool was_resumed = std::count_if(records.begin(), records.end(), begins_session) > 1;
  unsigned session = 0;
  for (const Superstep& record : records) {
    if (record.seconds.empty()) continue;
    if (begins_session(record) && was_resumed)
      out << fmt::format("  session {}, {}\n", ++session, counted(record.seconds.size(), "# rank[s]"));
    print_record(out, record);
    h += h_of(record);
    hidden_h += hidden_of(record);
    ranks = std::max(ranks, record.seconds.size());
    hidden = std::accumulate(record.hidden_seconds.begin(), record.hidden_seconds.end(), hidden);
    waited += std::accumulate(record.seconds.begin(), record.seconds.end(), 0.0) -
              std::accumulate(record.work_seconds.begin(), record.work_seconds.end(), 0.0);
  }
  if (ranks > 1)
    out << fmt::format("  main threads communicated {:.3f} s while workers computed, and waited {:.3f} s\n",
                       hidden, waited);
  if (hidden_h > 0)
    out << fmt::format("  of all h, {}, {:.0f} % was hidden behind their work\n", bytes_text(h),
                       100 * static_cast<double>(hidden_h) / static_cast<double>(h));
}

}  // namespace bsp2::jobs
