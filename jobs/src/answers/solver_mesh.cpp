#include "answers/solver_mesh.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "options/command_line.hpp"

namespace bsp2::jobs {

MeshSummary make_solver_mesh(const MeshCommand& command, supersteps::RunResult& result) {
  api::MadeSolverMesh made = api::make_solver_mesh(command.options, result, "--");
  auto& report = result.report;
  report.warnings.insert(report.warnings.end(), made.warnings.begin(), made.warnings.end());
  report.notes.insert(report.notes.end(), made.notes.begin(), made.notes.end());
  if (command.second_order) io::add_middles(made.mesh);
  made.summary.points = made.mesh.points().size();
  io::write_solver_mesh(command.output, made.mesh, command.gmsh_version);
  return made.summary;
}

void print_mesh_summary(std::ostream& out, const MeshSummary& summary, bool with_histogram) {
  out << fmt::format("\n  mesh      {}, {}, {}; volume {:.12g}\n",
                     summary.polyhedra ? counted(summary.cells, "# polyhedr[on|a]")
                                       : counted(summary.cells, "# tetrahedr[on|a]"),
                     counted(summary.points, "# point[s]"), counted(summary.faces, "# face[s]"),
                     summary.volume);
  out << fmt::format(
      "  faces     {} on the outside, {} between two cells{}\n", grouped(summary.outer_faces),
      grouped(summary.faces - summary.outer_faces - summary.overused_faces),
      summary.overused_faces > 0 ? ", " + counted(summary.overused_faces, "# of more than two cells") : "");
  for (const auto& [name, volume] : summary.volumes)
    if (summary.volumes.size() > 1) out << fmt::format("  volume    {}: {:.12g}\n", name, volume);
  for (const auto& [name, faces] : summary.groups)
    out << fmt::format("  group     {}: {}\n", name, counted(faces, "# face[s]"));
  if (summary.polyhedra) return;
  out << fmt::format(
      "  shape     dihedral angles {:.3g} to {:.4g} degrees, smallest of each {:.3g} on average\n",
      summary.smallest_angle, summary.largest_angle, summary.mean_smallest_angle);
  out << fmt::format("            aspect (regular: 1, flat: 0) {:.3g} at least, {:.3g} on average\n",
                     summary.smallest_aspect, summary.mean_aspect);
  const double percent = summary.cells > 0 ? 100.0 / static_cast<double>(summary.cells) : 0;
  out << fmt::format("            below 1, 5 and 10 degrees: {}, {} and {} ({:.2g} %)\n",
                     grouped(summary.below[0]), grouped(summary.below[1]),
                     counted(summary.below[2], "# tetrahedr[on|a]"),
                     percent * static_cast<double>(summary.below[2]));
  if (!with_histogram) return;
  const auto most = *std::max_element(summary.histogram.begin(), summary.histogram.end());
  for (std::size_t i = 0; i < summary.histogram.size(); ++i)
    out << fmt::format("  {:>5}-{:<3} {:>12} {}\n", 10 * i, 10 * (i + 1), grouped(summary.histogram[i]),
                       std::string(most > 0 ? summary.histogram[i] * 40 / most : 0, '#'));
}

namespace {

nlohmann::ordered_json described(const MeshSummary& summary) {
  nlohmann::ordered_json mesh;
  mesh["type"] = summary.polyhedra ? "polyhedra" : "tetrahedra";
  mesh["cells"] = summary.cells;
  mesh["points"] = summary.points;
  mesh["faces"] = summary.faces;
  mesh["outer_faces"] = summary.outer_faces;
  mesh["volume"] = summary.volume;
  for (const auto& [name, volume] : summary.volumes) mesh["volumes"][name] = volume;
  mesh["groups"] = nlohmann::ordered_json::object();
  for (const auto& [name, faces] : summary.groups) mesh["groups"][name] = faces;
  if (summary.polyhedra) return mesh;
  mesh["dihedral_angles"] = {{"smallest", summary.smallest_angle},
                             {"largest", summary.largest_angle},
                             {"mean_smallest", summary.mean_smallest_angle},
                             {"below_1", summary.below[0]},
                             {"below_5", summary.below[1]},
                             {"below_10", summary.below[2]},
                             {"histogram", summary.histogram}};
  mesh["aspect"] = {{"smallest", summary.smallest_aspect}, {"mean", summary.mean_aspect}};
  return mesh;
}

}  // namespace

std::string with_mesh(const std::string& report, const MeshSummary& summary) {
  auto json = nlohmann::ordered_json::parse(report);
  auto& mesh = json["solver_mesh"] = described(summary);
  if (!summary.polyhedra) {
    mesh["size"] = summary.size;
    mesh["clean"] = summary.clean;
    mesh["moved_corners"] = summary.moved_points;
    mesh["largest_move"] = summary.largest_move;
    mesh["taken_away"] = summary.taken_away;
  }
  mesh["seconds"] = {{"complex", summary.seconds_of_cells}, {"shape", summary.seconds_of_shape}};
  return json.dump(2) + "\n";
}

std::vector<std::string> check_mesh_file(const RunCommand& command, std::ostream& out) {
  const std::filesystem::path& path = *command.checked_mesh;
  const api::CheckedMesh checked = api::check_solver_mesh(path);
  if (!command.quiet) print_mesh_summary(out << path.string() << '\n', checked.summary, command.stats);
  if (command.report) {
    nlohmann::ordered_json json{{"file", path.string()}};
    json["solver_mesh"] = described(checked.summary);
    json["solver_mesh"]["overused_faces"] = checked.summary.overused_faces;
    json["faults"] = checked.faults;
    json["notes"] = checked.notes;
    io::make_folder(io::folder_of(*command.report));
    io::write_file(*command.report, json.dump(2) + "\n");
  }
  if (checked.faults.empty()) return checked.notes;
  out.flush();
  std::string text;
  for (const std::string& fault : checked.faults) text += (text.empty() ? "" : ", ") + fault;
  throw Error("'" + path.string() + "' is no valid mesh: " + text);
}

}  // namespace bsp2::jobs
