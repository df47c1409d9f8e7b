#include "bsp2/api/report/report_json.hpp"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

namespace bsp2::api {
namespace {

using Json = nlohmann::ordered_json;

/// A path need not be UTF-8, a JSON text must.
std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json superstep(const supersteps::SuperstepRecord& record) {
  return {{"name", record.name},
          {"step", record.step},
          {"seconds", record.seconds},
          {"work_seconds", record.work_seconds},
          {"hidden_seconds", record.hidden_seconds},
          {"hidden_bytes", record.hidden_bytes},
          {"bytes_sent", record.bytes_sent},
          {"bytes_received", record.bytes_received},
          {"cells", record.cells},
          {"predicted_seconds", record.predicted_seconds}};
}

/// null where there is nothing: no cells have no centroid.
Json or_null(const std::vector<double>& values) { return values.empty() ? Json(nullptr) : Json(values); }

/// Volume, centroid and moments, in the order of the report.
void add_volume(Json& json, const supersteps::Measures& measures) {
  json["volume"] = {{"in", measures.in_volume}, {"fuzzy", measures.fuzzy_volume}};
}
void add_moments(Json& json, const supersteps::Measures& measures) {
  json["centroid"] = or_null(measures.centroid);
  json["inertia"] = measures.inertia;
  if (!measures.inertia_least.empty())
    json["inertia_interval"] = Json::array({measures.inertia_least, measures.inertia_most});
}

Json named(const supersteps::NamedMeasures& measures) {
  Json json{{"name", measures.name}, {"dimension", measures.dimension}};
  add_volume(json, measures);
  add_moments(json, measures);
  return json;
}

Json named(const supersteps::NamedPart& part) {
  Json json{{"part", part.part}, {"name", part.name}};
  if (part.colour) {
    const auto& [red, green, blue, opacity] = *part.colour;
    const std::string colour = fmt::format("#{:02x}{:02x}{:02x}", red, green, blue);
    json["color"] = opacity == 255 ? colour : colour + fmt::format("{:02x}", opacity);
  }
  json["volume"] = part.volume;
  return json;
}

Json cleaned(const supersteps::CleaningReport& cleaning) {
  Json json{{"file", cleaning.file.string()},          {"length", cleaning.length},
            {"merged_points", cleaning.merged_points}, {"slivers", cleaning.slivers},
            {"left_out", cleaning.left_out},           {"left", cleaning.left},
            {"triangles", cleaning.triangles},         {"moved", cleaning.moved},
            {"volume_change", cleaning.volume_change}, {"self_intersections", cleaning.crossings}};
  if (cleaning.has_given_up) json["self_intersections"] = nullptr;  // not looked for in what was found
  return json;
}

Json overlapping(const supersteps::OverlappingMesh& mesh) {
  Json json{{"place", mesh.place},
            {"file", nullptr},
            {"primitive", mesh.primitive},
            {"triangles", mesh.triangles},
            {"volume_by_faces", nullptr}};
  if (!mesh.file.empty()) json["file"] = mesh.file;
  if (mesh.volume_by_faces) json["volume_by_faces"] = *mesh.volume_by_faces;
  return json;
}

Json described(const MeshFigures& summary) {
  Json mesh;
  mesh["type"] = summary.polyhedra ? "polyhedra" : "tetrahedra";
  mesh["cells"] = summary.cells;
  mesh["points"] = summary.points;
  mesh["faces"] = summary.faces;
  mesh["outer_faces"] = summary.outer_faces;
  mesh["volume"] = summary.volume;
  mesh["volumes"] = Json::object();
  for (const auto& [name, volume] : summary.volumes) mesh["volumes"][name] = volume;
  mesh["groups"] = Json::object();
  // Where a part is called 'outside' two groups have one name.
  for (const auto& [name, faces] : summary.groups)
    mesh["groups"][name] = mesh["groups"].value(name, std::uint64_t{0}) + faces;
  if (summary.polyhedra) return mesh;
  mesh["dihedral_angles"] = {{"smallest", summary.smallest_angle},
                             {"largest", summary.largest_angle},
                             {"mean_smallest", summary.mean_smallest_angle},
                             {"below_1", summary.below[0]},
                             {"below_5", summary.below[1]},
                             {"below_10", summary.below[2]},
                             {"of_solid_below_1", summary.below_of_solid[0]},
                             {"of_solid_below_5", summary.below_of_solid[1]},
                             {"of_solid_below_10", summary.below_of_solid[2]},
                             {"histogram", summary.histogram}};
  mesh["aspect"] = {{"smallest", summary.smallest_aspect}, {"mean", summary.mean_aspect}};
  return mesh;
}

/// How it was made, too.
Json made(const MeshFigures& mesh) {
  Json json = described(mesh);
  if (!mesh.polyhedra) {
    json["size"] = mesh.size;
    json["clean"] = mesh.clean;
    json["moved_corners"] = mesh.moved_points;
    json["bent_edges"] = mesh.bent_edges;
    json["largest_move"] = mesh.largest_move;
    json["taken_away"] = mesh.taken_away;
  }
  json["seconds"] = {{"complex", mesh.seconds_of_cells}, {"shape", mesh.seconds_of_shape}};
  return json;
}

}  // namespace

std::string to_json(const supersteps::RunReport& report, const MeshFigures* mesh) {
  Json json;
  json["model"] = report.model;
  json["dimension"] = report.dimension;
  json["ranks"] = report.ranks;
  json["threads"] = report.threads;
  json["regions"] = report.regions;
  json["level"] = nullptr;
  if (report.has_cells) json["level"] = report.level;
  json["primitives"] = report.primitives;
  json["hyperplanes"] = report.hyperplanes;
  json["cells"] = nullptr;
  if (report.has_cells)
    json["cells"] = {{"in", report.in_cells}, {"fuzzy", report.fuzzy_cells}, {"out", nullptr}};
  if (report.out_cells) json["cells"]["out"] = *report.out_cells;
  add_volume(json, report);
  if (report.tolerance) json["tolerance"] = *report.tolerance;
  if (report.angle) json["view"] = {{"eye", report.eye}, {"angle", *report.angle}};
  add_moments(json, report);
  for (const auto& part : report.named_parts) json["parts"].push_back(named(part));
  for (const auto& measures : report.measures) json["measures"].push_back(named(measures));
  json["bounds"] = nullptr;
  if (!report.lower.empty()) json["bounds"] = Json::array({report.lower, report.upper});
  json["boundary"] = nullptr;
  if (report.boundary)
    json["boundary"] = {{"triangles", report.boundary->triangles},
                        {"area", report.boundary->area},
                        {"closed", report.boundary->closed}};
  if (report.boundary && !report.boundary->cleaned.empty())
    for (const auto& cleaning : report.boundary->cleaned)
      json["boundary"]["cleaned"].push_back(cleaned(cleaning));
  if (const auto& simplices = report.simplices)
    json["simplices"] = {{"count", simplices->simplices},
                         {"smallest_angle", simplices->smallest_angle},
                         {"incomplete_cells", simplices->incomplete_cells},
                         {"left_out_volume", simplices->left_out_volume}};
  json["digest"] = nullptr;
  if (report.has_cells) json["digest"] = report.digest;
  json["surface_digest"] = nullptr;
  if (report.boundary) json["surface_digest"] = report.boundary->digest;
  json["supersteps"] = Json::array();
  for (const auto& record : report.supersteps) json["supersteps"].push_back(superstep(record));
  json["stats"] = nullptr;
  if (report.has_cells)
    json["stats"] = {{"splits", report.splits},
                     {"predicates", report.predicates},
                     {"exact_fallbacks", report.exact_fallbacks}};
  json["seconds"] = report.seconds;
  json["cpu_seconds"] = report.cpu_seconds;
  json["peak_rss_bytes"] = report.peak_rss_bytes;
  json["warnings"] = report.warnings;
  json["notes"] = report.notes;
  for (const auto& failed : report.failed) json["failed"].push_back(failed.text);
  json["overlapping_meshes"] = Json::array();
  for (const auto& mesh : report.overlapping_meshes) json["overlapping_meshes"].push_back(overlapping(mesh));
  if (mesh != nullptr) json["solver_mesh"] = made(*mesh);
  return text_of(json);
}

std::string to_json(const MeshCheck& check) {
  Json json{{"file", check.file.string()}};
  json["solver_mesh"] = described(check.figures);
  json["solver_mesh"]["overused_faces"] = check.figures.overused_faces;
  json["faults"] = check.faults;
  json["notes"] = check.notes;
  return text_of(json);
}

std::string to_csv(const std::vector<supersteps::SuperstepRecord>& records) {
  std::string text =
      "superstep,step,rank,seconds,work_seconds,hidden_seconds,bytes_sent,bytes_received,hidden_bytes,cells,"
      "predicted_seconds\n";
  for (const supersteps::SuperstepRecord& record : records)
    for (std::size_t rank = 0; rank < record.seconds.size(); ++rank)
      text += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", record.name, record.step, rank,
                          record.seconds[rank], record.work_seconds[rank], record.hidden_seconds[rank],
                          record.bytes_sent[rank], record.bytes_received[rank], record.hidden_bytes[rank],
                          record.cells[rank], record.predicted_seconds);
  return text;
}

}  // namespace bsp2::api
