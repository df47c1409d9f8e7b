#include "answers/snapshot_info.hpp"

#include <spdlog/fmt/fmt.h>

#include <ostream>
#include <string>
#include <utility>

#include "bsp2/bsp2.hpp"
#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {

namespace {

/// "in fuzzy"
std::string kept(const SnapshotInfo& info) {
  std::string kinds;
  for (const auto& [is_kept, kind] :
       {std::pair(info.keep_in, "in"), {info.keep_fuzzy, "fuzzy"}, {info.keep_out, "out"}})
    if (is_kept) kinds += (kinds.empty() ? "" : " ") + std::string(kind);
  return kinds;
}

}  // namespace

void print_snapshot(std::ostream& out, const std::filesystem::path& path) {
  const SnapshotInfo info = snapshot_info(path);
  const auto line = [&](const char* name, const std::string& value) {
    out << fmt::format("  {:<14}{}\n", name, value);
  };
  out << path.string() << '\n';
  line("model", info.model);
  line("dimension", std::to_string(info.dimension));
  line("coincidence", fmt::format("{}", info.coincidence));
  if (info.curved) line("curved", "spheres, cylinders and cones are round");
  if (info.parts_by_colour) line("parts", "each colour is one");
  if (info.tolerance) line("tolerance", fmt::format("{}", *info.tolerance));
  if (info.angle)
    line("angle", fmt::format("{} degrees, seen from ({})", *info.angle, fmt::join(info.eye, ", ")));
  if (info.level) line("level", std::to_string(*info.level));
  line("keep", kept(info));
  line("regions",
       fmt::format("{}, {} of them {}", grouped(info.regions), grouped(info.unfinished_regions),
                   info.is_complete && info.undecided > 0 ? "with cells that stay FUZZY" : "unfinished"));
  line("steps", std::to_string(info.steps));
  line("IN cells", fmt::format("{} finished, volume {:.12g}{}", grouped(info.in_cells), info.in_volume,
                               info.undecided > 0 ? "; others are held beside what is undecided" : ""));
  if (info.keep_out) line("OUT cells", fmt::format("{} finished", grouped(info.out_cells)));
  line("undecided", counted(info.undecided, "# cell[s]"));
  if (info.in_cells > 0 || info.undecided == 0)
    line("digest", info.digest + (info.is_complete && info.undecided == 0 ? "" : " (of the finished cells)"));
  if (info.has_surface) line("surface", info.has_faces ? "with its faces" : "its triangles");
  line("state", !info.is_complete ? "unfinished; go on with 'bsp2 resume'"
                : info.undecided > 0
                    ? "complete" + (info.level ? fmt::format(" to level {}", *info.level) : "") +
                          "; 'bsp2 resume' tells volumes and digest of all cells"
                    : "complete");
}

}  // namespace bsp2::jobs
