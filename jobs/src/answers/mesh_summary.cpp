#include "answers/mesh_summary.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ostream>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {

void print_mesh_summary(std::ostream& out, const MeshFigures& mesh, bool with_histogram) {
  out << fmt::format(
      "\n  mesh      {}, {}, {}; volume {:.12g}\n",
      mesh.polyhedra ? counted(mesh.cells, "# polyhedr[on|a]") : counted(mesh.cells, "# tetrahedr[on|a]"),
      counted(mesh.points, "# point[s]"), counted(mesh.faces, "# face[s]"), mesh.volume);
  out << fmt::format(
      "  faces     {} on the outside, {} between two cells{}\n", grouped(mesh.outer_faces),
      grouped(mesh.faces - mesh.outer_faces - mesh.overused_faces),
      mesh.overused_faces > 0 ? ", " + counted(mesh.overused_faces, "# of more than two cells") : "");
  for (const auto& [name, volume] : mesh.volumes)
    if (mesh.volumes.size() > 1) out << fmt::format("  volume    {}: {:.12g}\n", name, volume);
  for (const auto& [name, faces] : mesh.groups)
    out << fmt::format("  group     {}: {}\n", name, counted(faces, "# face[s]"));
  if (mesh.polyhedra) return;
  out << fmt::format(
      "  shape     dihedral angles {:.3g} to {:.4g} degrees, smallest of each {:.3g} on average\n",
      mesh.smallest_angle, mesh.largest_angle, mesh.mean_smallest_angle);
  out << fmt::format("            aspect (regular: 1, flat: 0) {:.3g} at least, {:.3g} on average\n",
                     mesh.smallest_aspect, mesh.mean_aspect);
  const double percent = mesh.cells > 0 ? 100.0 / static_cast<double>(mesh.cells) : 0;
  out << fmt::format("            below 1, 5 and 10 degrees: {}, {} and {} ({:.3g} %)\n",
                     grouped(mesh.below[0]), grouped(mesh.below[1]),
                     counted(mesh.below[2], "# tetrahedr[on|a]"),
                     percent * static_cast<double>(mesh.below[2]));
  if (mesh.below_of_solid[2] > 0)
    out << fmt::format("            of these where the solid is as sharp: {}, {} and {}\n",
                       grouped(mesh.below_of_solid[0]), grouped(mesh.below_of_solid[1]),
                       grouped(mesh.below_of_solid[2]));
  if (!with_histogram) return;
  const auto most = *std::max_element(mesh.histogram.begin(), mesh.histogram.end());
  for (std::size_t i = 0; i < mesh.histogram.size(); ++i)
    out << fmt::format("  {:>5}-{:<3} {:>12} {}\n", 10 * i, 10 * (i + 1), grouped(mesh.histogram[i]),
                       std::string(most > 0 ? mesh.histogram[i] * 40 / most : 0, '#'));
}

std::vector<std::string> check_mesh_file(const RunCommand& command, std::ostream& out) {
  const std::filesystem::path& path = *command.checked_mesh;
  const MeshCheck checked = check_mesh(path);
  if (!command.quiet) print_mesh_summary(out << path.string() << '\n', checked.figures, command.stats);
  if (const auto& report = command.options.outputs.report) checked.write(*report);
  if (checked.faults.empty()) {
    if (!command.quiet)
      out << "  valid     all right side out, faces of one or two tetrahedra, groups of such faces\n";
    return checked.notes;
  }
  out.flush();
  std::string text;
  for (const std::string& fault : checked.faults) text += (text.empty() ? "" : ", ") + fault;
  throw Error("'" + path.string() + "' is no valid mesh: " + text);
}

}  // namespace bsp2::jobs
