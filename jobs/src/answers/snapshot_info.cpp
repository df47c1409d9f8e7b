#include "answers/snapshot_info.hpp"

#include <spdlog/fmt/fmt.h>

#include <numeric>
#include <ostream>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/io/outputs/snapshot.hpp"

namespace bsp2::jobs {

namespace {

/// "in fuzzy"
std::string kept(const io::SnapshotHead& head) {
  std::string kinds;
  for (const auto& [is_kept, kind] :
       {std::pair(head.keep_in, "in"), {head.keep_fuzzy, "fuzzy"}, {head.keep_out, "out"}})
    if (is_kept) kinds += (kinds.empty() ? "" : " ") + std::string(kind);
  return kinds;
}

}  // namespace

void print_snapshot(std::ostream& out, const std::filesystem::path& path) {
  const io::Snapshot snapshot = io::read_snapshot(path, io::SnapshotPart::head);
  const io::SnapshotHead& head = snapshot.head;
  const auto tokens =
      std::accumulate(snapshot.frontier_tokens.begin(), snapshot.frontier_tokens.end(), std::uint64_t{0});
  const auto line = [&](const char* name, const std::string& value) {
    out << fmt::format("  {:<14}{}\n", name, value);
  };
  out << path.string() << '\n';
  line("model", head.model);
  line("dimension", std::to_string(head.dimension));
  line("coincidence", fmt::format("{}", head.coincidence));
  if (head.curved) line("curved", "spheres, cylinders and cones are round");
  if (head.parts_by_colour) line("parts", "each colour is one");
  if (head.tolerance > 0) line("tolerance", fmt::format("{}", head.tolerance));
  if (head.angle > 0)
    line("angle", fmt::format("{} degrees, seen from ({})", head.angle, fmt::join(head.eye, ", ")));
  if (head.level) line("level", std::to_string(*head.level));
  line("keep", kept(head));
  line("regions", fmt::format("{}, {} of them {}", grouped(head.partition_hyperplane.size() + 1),
                              grouped(snapshot.frontier_region.size()),
                              head.complete && tokens > 0 ? "with cells that stay FUZZY" : "unfinished"));
  line("steps", std::to_string(head.steps));
  line("IN cells", fmt::format("{} finished, volume {:.12g}{}", grouped(head.in_cells), head.in_volume,
                               tokens > 0 ? "; others are held beside what is undecided" : ""));
  if (head.keep_out) line("OUT cells", fmt::format("{} finished", grouped(head.out_cells)));
  line("undecided", counted(tokens, "# cell[s]"));
  if (head.in_cells > 0 || tokens == 0)
    line("digest", head.digest + (head.complete && tokens == 0 ? "" : " (of the finished cells)"));
  line("state", !head.complete ? "unfinished; go on with 'bsp2 resume'"
                : tokens > 0   ? "complete" + (head.level ? fmt::format(" to level {}", *head.level) : "") +
                                   "; 'bsp2 resume' tells volumes and digest of all cells"
                             : "complete");
}

}  // namespace bsp2::jobs
