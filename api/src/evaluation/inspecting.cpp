#include <numeric>

#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/products/solver_mesh.hpp"
#include "bsp2/api/report/report_json.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/snapshot.hpp"

namespace bsp2 {

SnapshotInfo snapshot_info(const std::filesystem::path& path) {
  return guarded([&] {
    io::check_snapshot_is_readable(path);
    const io::Snapshot snapshot = io::read_snapshot(path, io::SnapshotPart::head);
    const io::SnapshotHead& head = snapshot.head;
    SnapshotInfo info{.model = head.model,
                      .dimension = head.dimension,
                      .coincidence = head.coincidence,
                      .curved = head.curved,
                      .parts_by_colour = head.parts_by_colour,
                      .level = head.level,
                      .eye = head.eye,
                      .keep_in = head.keep_in,
                      .keep_fuzzy = head.keep_fuzzy,
                      .keep_out = head.keep_out,
                      .regions = head.partition_hyperplane.size() + 1,
                      .unfinished_regions = snapshot.frontier_region.size(),
                      .steps = head.steps,
                      .in_cells = head.in_cells,
                      .out_cells = head.out_cells,
                      .in_volume = head.in_volume,
                      .digest = head.digest,
                      .undecided = std::accumulate(snapshot.frontier_tokens.begin(),
                                                   snapshot.frontier_tokens.end(), std::uint64_t{0}),
                      .is_complete = head.complete,
                      .has_surface = head.has_surface,
                      .has_faces = head.has_faces};
    if (head.tolerance > 0) info.tolerance = head.tolerance;
    if (head.angle > 0) info.angle = head.angle;
    return info;
  });
}

MeshCheck check_mesh(const std::filesystem::path& file) {
  return guarded([&] { return api::checked_mesh(file); });
}

void MeshCheck::write(const std::filesystem::path& report) const {
  guarded([&] {
    io::make_folder(io::folder_of(report));
    io::write_file(report, api::to_json(*this));
  });
}

}  // namespace bsp2
