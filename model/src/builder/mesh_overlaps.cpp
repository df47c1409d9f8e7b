#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <variant>
#include <vector>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "bsp2/model/expression/line_finder.hpp"
#include "builder/mesh_shells.hpp"
#include "mesh/mesh_crossing.hpp"
#include "text/csg_arguments.hpp"
#include "text/csg_scanner.hpp"

namespace bsp2::model {
namespace {

/// What is wrong with a mesh, and what its faces sum up to by themselves.
struct Finding {
  std::string fault;     ///< "crosses itself: ..."; empty: nothing
  bool crosses = false;  ///< else shells lie in each other, or one is inside out
  double volume = 0;
};

/// The sum over faces cancels itself where a mesh is thin or winds both ways round, so it takes numbers of
/// twice a double's digits.
double sum_of_faces(const TriangleMesh& mesh) {
  using Quad = boost::multiprecision::cpp_bin_float_quad;
  const Point3& o = mesh.points[mesh.triangles[0][0]];
  Quad sum = 0;
  for (const auto& triangle : mesh.triangles) {
    Quad e[3][3];
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) e[i][k] = Quad(mesh.points[triangle[i]][k]) - o[k];
    sum += e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
           e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
           e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
  }
  return static_cast<double>(sum / 6);
}

std::string point_text(const Point3& p) {
  return "(" + text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]) + ")";
}

Finding finding_of(const TriangleMesh& mesh, unsigned threads) {
  std::string fault;
  const auto crossing = self_crossing(mesh, threads);
  if (crossing) {
    fault = "crosses itself: " + text_of(*crossing);
  } else if (const auto odd = odd_winding(mesh)) {
    fault = "does not wind once around all that it encloses: beside the corner " + point_text(odd->corner) +
            " its faces wind " + counted(odd->times, "# time[s] around a point");
  } else {
    return {};
  }
  return {fault, crossing.has_value(), sum_of_faces(mesh)};
}

const TriangleMesh& mesh_of(const Expression& solid) {
  return std::get<TriangleMesh>(std::get<Primitive>(solid.node().value));
}

bool is_large(const TriangleMesh& mesh) { return mesh.triangles.size() >= 10000; }

/// Of each mesh once. Where a few are large, all threads look at each of those; one looks at each other one.
/// @param sound of these nothing is found.
std::unordered_map<const Node*, Finding> findings_of(const Model& model, unsigned threads,
                                                     std::span<const TriangleMesh* const> sound) {
  const std::unordered_set<const TriangleMesh*> known(sound.begin(), sound.end());
  std::unordered_map<const Node*, Finding> findings;
  std::vector<std::pair<const TriangleMesh*, Finding*>> meshes;  // elements of a map keep their place
  for (const Model::Mesh& mesh : model.meshes) {
    const auto [found, is_new] = findings.try_emplace(&mesh.solid.node());
    const TriangleMesh& triangles = mesh_of(mesh.solid);
    if (is_new && !known.contains(&triangles)) meshes.emplace_back(&triangles, &found->second);
  }
  constexpr std::size_t grain = 16;
  const auto end_of_large =
      std::partition(meshes.begin(), meshes.end(), [](const auto& mesh) { return is_large(*mesh.first); });
  const std::span large(meshes.begin(), end_of_large), others(end_of_large, meshes.end());
  const auto look_at = [&](std::span<const std::pair<const TriangleMesh*, Finding*>> some,
                           std::size_t at_once) {
    geometry::for_each_range(some.size(), at_once, threads, [&](std::size_t first, std::size_t end) {
      for (const auto& [mesh, finding] : some.subspan(first, end - first)) *finding = finding_of(*mesh, 1);
    });
  };
  if (large.size() >= threads)
    look_at(large, 1);
  else
    for (const auto& [mesh, finding] : large) *finding = finding_of(*mesh, threads);
  look_at(others, grain);
  return findings;
}

/// Whether reading it told of shells in each other.
bool is_nested(TriangleMesh mesh) { return turn_shells(mesh).nested > 0; }

std::string warning_of(const Model::Mesh& mesh, const std::string& fault, std::optional<double> volume) {
  std::string text = (mesh.file.empty() ? "this polyhedron " : "the mesh of " + mesh.file.string() + " ") +
                     fault + ". A point counts once, however often the faces wind around it";
  if (volume)
    text += "; the volume that the faces sum up to, " + text_of(*volume) + ", may count it several times";
  return text;
}

}  // namespace

MeshOverlaps overlaps_of(const Model& model, std::string_view text, const std::string& name, unsigned threads,
                         std::span<const TriangleMesh* const> sound) {
  constexpr std::size_t most_warnings = 100;
  MeshOverlaps overlaps;
  const std::unordered_map<const Node*, Finding> findings = findings_of(model, threads, sound);
  std::unordered_set<const Node*> seen;
  LineFinder lines(text);
  for (const Model::Mesh& mesh : model.meshes) {
    const TriangleMesh& triangles = mesh_of(mesh.solid);
    const Finding& finding = findings.at(&mesh.solid.node());
    if (finding.fault.empty()) continue;
    const bool is_new = seen.insert(&mesh.solid.node()).second;
    const std::string place = name + ":" + lines.at(mesh.offset);
    std::optional<double> volume;
    if (mesh.scale) volume = *mesh.scale * finding.volume;
    const auto part = std::lower_bound(model.part_offsets.begin(), model.part_offsets.end(), mesh.offset) -
                      model.part_offsets.begin();
    overlaps.meshes.push_back(
        {place, mesh.file.string(), static_cast<std::size_t>(part), triangles.triangles.size(), volume});
    if (!is_new || overlaps.warnings.size() == most_warnings) continue;
    const bool is_told = !mesh.file.empty() && !finding.crosses && is_nested(triangles);  // when it was read
    if (!is_told) overlaps.warnings.push_back(place + ": " + warning_of(mesh, finding.fault, volume));
  }
  return overlaps;
}

}  // namespace bsp2::model
