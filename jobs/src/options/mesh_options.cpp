#include "options/mesh_options.hpp"

#include <CLI/CLI.hpp>
#include <cmath>

#include "options/paths.hpp"

namespace bsp2::jobs {
namespace {

CLI::Validator is_length() { return is_number(0.0, 1e300, "0 or more"); }

std::pair<std::string, double> part_size(const std::string& text) {
  const auto equal = text.rfind('=');
  double size = 0;
  if (equal == std::string::npos || equal == 0 || !CLI::detail::lexical_cast(text.substr(equal + 1), size) ||
      !(size > 0) || !std::isfinite(size))
    throw Error("--part-size: '" + text + "' must be NAME=H, a part's name and a length above 0");
  return {text.substr(0, equal), size};
}

constexpr auto mesh_footer =
    "Examples:\n"
    "  bsp2 mesh model.csg -o model.msh --size 2\n"
    "  bsp2 mesh model.csg -o model.inp --element-order 2 --group fixed=x==min\n"
    "  bsp2 mesh model.csg -o case              an OpenFOAM case\n"
    "  bsp2 mesh --check model.msh              what a mesh is like; is it valid?\n"
    "On several ranks the cells are computed by all and meshed by the first one.";

void add_own_options(CLI::App& app, MeshText& text) {
  const auto group = "What the mesh is like";
  app.add_option("-o,--output", text.output,
                 "the mesh, as the ending says: .msh, .inp, .xdmf, .vtu;\na folder: an OpenFOAM case")
      ->required()
      ->check(is_named())
      ->type_name("FILE")
      ->group(group);
  app.add_option(
         "--type", text.type,
         "tetrahedra; dual: polyhedra about their points, for\nfinite volumes; polyhedra: the cells as they "
         "are\n(default: tetrahedra; OpenFOAM: dual)")
      ->check(is_one_of({"tetrahedra", "dual", "polyhedra"}))
      ->type_name("TYPE")
      ->group(group);
  app.add_option("--size", text.size,
                 "how long edges shall be\n(default: a twentieth of the model's diagonal;\n0: the cells' own "
                 "tetrahedra)")
      ->check(is_length())
      ->type_name("H")
      ->group(group);
  app.add_option("--part-size", text.part_sizes, "the same in one part; repeat for several")
      ->allow_extra_args(false)
      ->type_name("NAME=H")
      ->group(group);
  app.add_option(
         "--size-field", text.size_field,
         "sizes by place: lines of x y z and a length, or a .vtu\nor .msh with such an array; the nearest "
         "counts;\nnowhere above --size. What is round is refined alike")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--growth", text.growth,
                 "by which share of the distance edges may grow from\nwhere they are short")
      ->check(is_number(0.05, 10.0, "0.05 .. 10"))
      ->type_name("G")
      ->capture_default_str()
      ->group(group);
  app.add_option("--clean", text.clean,
                 "absorb what is shorter, by moves of so much at most\n(default: a millionth of the smallest "
                 "part's size, up to\n16 millionths where tetrahedra would be flat or have\nangles below 1 "
                 "degree; of what is round, its tolerance\nif "
                 "that is more)")
      ->check(is_length())
      ->type_name("T")
      ->group(group);
  app.add_option(
         "--group", text.groups,
         "faces by name: those where x==min, y==2.5, z>=0,\n2*x+y<=3, colour==red, joined by &; angle<=30 "
         "\ndivides them at edges; repeat for several")
      ->allow_extra_args(false)
      ->type_name("NAME=WHERE")
      ->group(group);
  app.add_option("--element-order", text.order, "1, or 2: with points in the middle of edges")
      ->check(is_number(1, 2, "1 .. 2"))
      ->type_name("N")
      ->group(group);
  app.add_option("--msh-version", text.version, "of .msh files: 4.1 or 2.2 (default: 4.1)")
      ->check(is_one_of({"4.1", "2.2"}))
      ->type_name("V")
      ->group(group);
}

/// `--check`, which leaves no room for what says how a mesh is made. After all options but --report, --stats
/// and --quiet.
void add_check_option(CLI::App& app, MeshText& text) {
  CLI::Option* output = app.get_option("--output");
  const auto ask = [&text, output](std::int64_t) {
    text.check = true;
    output->required(false);
  };
  std::vector<CLI::Option*> of_making;
  for (CLI::Option* option : app.get_options())
    if (!option->get_positional() && option != app.get_help_ptr() && option != app.get_help_all_ptr())
      of_making.push_back(option);
  CLI::Option* check = app.add_flag_function(
      "--check", ask, "make none: tell what the mesh in a .msh file is like, and if\nit is valid");
  for (CLI::Option* option : of_making) check->excludes(option);
}

/// What they mean. @throws bsp2::Error if they make no sense.
SolverMeshOutput mesh_output_of(const MeshText& text) {
  SolverMeshOutput output;
  output.file = text.output;
  const FileFormat format = file_format(output.file);
  if (!format.solver_mesh) throw Error("-o: '" + text.output + "' must end in " + endings().solver_meshes);
  SolverMeshOptions& options = output.mesh;
  options.polyhedra = text.type == "polyhedra";
  options.dual = text.type.empty() ? format.openfoam : text.type == "dual";
  if ((options.polyhedra || options.dual) && !format.polyhedra)
    throw Error("--type " + text.type + ": only OpenFOAM cases and .vtu files hold polyhedra, not '" +
                text.output + "'");
  options.clean = text.clean;
  options.size = text.size;
  if (!text.size_field.empty()) options.size_field = read_size_field(text.size_field);
  options.growth = text.growth;
  for (const std::string& each : text.part_sizes) options.part_sizes.push_back(part_size(each));
  for (const std::string& each : text.groups) check_group(each);  // it is told now if it is wrong
  options.groups = text.groups;
  output.gmsh_version = text.version == "2.2" ? 22 : 41;
  if (!text.version.empty() && !format.gmsh)
    throw Error("--msh-version: it is of .msh files, and '" + text.output + "' is none");
  output.second_order = text.order == 2;
  if (output.second_order && (options.polyhedra || options.dual || !format.second_order))
    throw Error(
        "--element-order 2: only tetrahedra in .msh, .inp, .xdmf and .vtu files may have points in the "
        "middle of edges");
  if (options.polyhedra &&
      (options.size.value_or(0) > 0 || !options.part_sizes.empty() || !options.size_field.empty()))
    throw Error("--size: polyhedra are the cells as they are; --type tetrahedra and dual have a size");
  return output;
}

}  // namespace

CLI::App* add_mesh_command(CLI::App& app, RunCommand& command, MeshText& text, WorkText& work) {
  CLI::App* mesh = app.add_subcommand("mesh", "Make a conforming mesh for solvers, with named parts");
  add_input(*mesh, "MODEL|SNAPSHOT", text.input,
            std::string(model_or_snapshot_words) + ";\nwith --check a mesh (.msh)");
  add_own_options(*mesh, text);
  add_solid_options(*mesh, command, work);
  add_tolerance_option(*mesh, command);
  add_level_option(*mesh, command, "is left out");
  add_threads_option(*mesh, command);
  add_check_option(*mesh, text);
  add_path(*mesh, "--report", text.report, "write the report", "FILE.json");
  mesh->add_flag("--stats", command.stats, "print how many dihedral angles are how large");
  mesh->add_flag("--quiet", command.quiet, "print no summary and no progress");
  mesh->footer(mesh_footer);
  return mesh;
}

void choose_mesh(const MeshText& text, RunCommand& command) {
  Options& options = command.options;
  if (!text.report.empty()) options.outputs.report = text.report;
  if (text.check) {
    command.checked_mesh = text.input;
    return;
  }
  options.outputs.solver_mesh = mesh_output_of(text);
  if (!text.size_field.empty()) options.outputs.read.emplace_back(text.size_field);
  choose_input(command, text.input);
  if (command.resume) return;
  const SolverMeshOptions& mesh = options.outputs.solver_mesh->mesh;
  options.size_field = mesh.size_field;
  if (mesh.size.value_or(0) > 0) options.size = mesh.size;
}

}  // namespace bsp2::jobs
