#include "bsp2/io/outputs/solver_mesh.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;

void add_middles(SolverMesh& mesh) {
  auto& points = mesh.tetrahedra.points;
  std::vector<std::array<std::uint32_t, 2>> edges;
  constexpr std::array<std::array<int, 2>, 6> ends{{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
  const auto edge = [](std::uint32_t a, std::uint32_t b) {
    return a < b ? std::array{a, b} : std::array{b, a};
  };
  for (const auto& t : mesh.tetrahedra.tetrahedra)
    for (const auto& [a, b] : ends) edges.push_back(edge(t[a], t[b]));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  const auto first = static_cast<std::uint32_t>(points.size());
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    return first + static_cast<std::uint32_t>(std::lower_bound(edges.begin(), edges.end(), edge(a, b)) -
                                              edges.begin());
  };
  for (const auto& [a, b] : edges) {
    meshing::Point p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = points[a][k] + (points[b][k] - points[a][k]) / 2;
    points.push_back(p);
  }
  for (const auto& t : mesh.tetrahedra.tetrahedra) {
    geometry::Interruption::check();
    auto& own = mesh.middles.emplace_back();
    for (std::size_t i = 0; i < ends.size(); ++i) own[i] = middle(t[ends[i][0]], t[ends[i][1]]);
  }
  for (const auto& [a, b, c] : mesh.tetrahedra.triangles)
    mesh.triangle_middles.push_back({middle(a, b), middle(b, c), middle(a, c)});
}

std::optional<SolverFormat> solver_format(const fs::path& path) {
  const std::string ending = path.extension().string();
  std::error_code ignored;
  if (ending == ".foam" || ending.empty()) return SolverFormat::openfoam;
  static const std::map<std::string, SolverFormat> formats{{".vtu", SolverFormat::vtu},
                                                           {".msh", SolverFormat::gmsh},
                                                           {".inp", SolverFormat::abaqus},
                                                           {".xdmf", SolverFormat::xdmf}};
  const auto found = formats.find(ending);
  if (found != formats.end()) return found->second;
  return fs::is_directory(path, ignored) ? std::optional(SolverFormat::openfoam) : std::nullopt;
}

fs::path solver_file(const fs::path& path) {
  if (solver_format(path) != SolverFormat::openfoam) return path;
  fs::path folder = path;
  if (path.extension() == ".foam") {
    if (path.parent_path().filename() == path.stem()) return path;
    folder.replace_extension();
  }
  fs::path named = fs::absolute(folder).lexically_normal();
  if (!named.has_filename()) named = named.parent_path();
  return folder / (named.filename().string() + ".foam");
}

std::vector<fs::path> solver_files(const fs::path& path) {
  std::vector<fs::path> files{solver_file(path)};
  const SolverFormat format = solver_format(path).value();
  if (format == SolverFormat::xdmf) files.push_back(fs::path(path).replace_extension(".h5"));
  if (format == SolverFormat::openfoam)
    for (const char* name : {"points", "faces", "owner", "neighbour", "boundary", "cellZones", "faceZones"})
      files.push_back(folder_of(files[0]) / "constant" / "polyMesh" / name);
  return files;
}

std::string solver_endings() {
  return ".msh (gmsh), .inp (CalculiX, Abaqus), .xdmf (dolfinx), .vtu (ParaView), or in none or .foam (a "
         "folder: an OpenFOAM case)";
}

bool holds_polyhedra(SolverFormat format) {
  return format == SolverFormat::openfoam || format == SolverFormat::vtu;
}
bool holds_second_order(SolverFormat format) { return format != SolverFormat::openfoam; }
bool holds_groups(SolverFormat format) { return format != SolverFormat::vtu; }

std::vector<std::string> plain_names(const std::vector<std::string>& names, std::set<std::string> taken) {
  const auto is_between = [](char c, char low, char high) { return low <= c && c <= high; };
  std::map<std::string, std::string> plain_of;
  const auto take = [&](std::string text) {
    for (char& c : text)
      if (is_between(c, 'A', 'Z')) c = static_cast<char>(c - 'A' + 'a');
    return taken.insert(std::move(text)).second;
  };
  std::vector<std::string> plain;
  for (const std::string& name : names) {
    const auto [entry, is_new] = plain_of.try_emplace(name, name);
    std::string& own = entry->second;
    for (char& c : own)
      if (!is_between(c, '0', '9') && !is_between(c, 'a', 'z') && !is_between(c, 'A', 'Z') && c != '-' &&
          c != '.')
        c = '_';
    const std::string first = own;
    for (int number = 2; is_new && !take(own); ++number) own = first + "_" + std::to_string(number);
    plain.push_back(own);
  }
  return plain;
}

void write_solver_mesh(const fs::path& path, const SolverMesh& mesh, int gmsh_version) {
  switch (solver_format(path).value()) {
    case SolverFormat::openfoam:
      return write_openfoam(solver_file(path), mesh);
    case SolverFormat::vtu:
      return write_solver_vtu(path, mesh);
    case SolverFormat::gmsh:
      return write_gmsh(path, mesh, gmsh_version);
    case SolverFormat::abaqus:
      return write_abaqus(path, mesh);
    case SolverFormat::xdmf:
      return write_xdmf(path, mesh);
  }
}

}  // namespace bsp2::io
