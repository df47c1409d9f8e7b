#include "evaluation/result.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "bsp2/api/report/report_json.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/surface/boundary.hpp"

namespace bsp2 {
namespace {

/// Room for all that some batches have. @throws Error if there is more than offsets can count.
void reserve(geometry::CellBatch& whole, const supersteps::SolidMesh& mesh) {
  std::size_t cells = 0, points = 0, facets = 0, vertices = 0;
  for (const auto& batch : mesh.batches) {
    cells += batch->size();
    points += batch->point_offset.back();
    facets += batch->facet_offset.back();
    vertices += batch->facet_vertex_offset.back();
  }
  if (std::max({points, facets, vertices}) > std::numeric_limits<std::uint32_t>::max())
    throw Error(counted(
        cells,
        "# cell[s] [is|are] too many to be shown as arrays, whose offsets have 32 bits; write them as .pvtu, "
        "or evaluate fewer (cells, tolerance, level)"));
  whole.points.reserve(points * static_cast<std::size_t>(mesh.dimension));
  whole.point_offset.reserve(cells + 1);
  whole.facet_offset.reserve(cells + 1);
  whole.facet_vertex_offset.reserve(facets + 1);
  whole.facet_vertices.reserve(vertices);
  whole.facet_hyperplane.reserve(facets);
  whole.label.reserve(cells);
  whole.primitive.reserve(cells);
  whole.part.reserve(cells);
  whole.region.reserve(cells);
  whole.level.reserve(cells);
  whole.volume.reserve(cells);
}

/// All cells as one batch; the others are given up one by one, once nothing can fail any more.
std::shared_ptr<const geometry::CellBatch> united(supersteps::SolidMesh& mesh) {
  if (mesh.batches.size() == 1) return mesh.batches.front();
  auto whole = std::make_shared<geometry::CellBatch>();
  whole->dimension = mesh.dimension;
  reserve(*whole, mesh);
  for (auto& batch : mesh.batches) {
    whole->append(*batch, 0, batch->size());
    batch.reset();
  }
  mesh.batches.clear();
  if (!whole->empty()) mesh.batches.push_back(whole);
  return whole;
}

/// Their bytes: labels are one each.
std::span<const std::uint8_t> bytes_of(const std::vector<geometry::Label>& labels) {
  static_assert(sizeof(geometry::Label) == 1);
  return {reinterpret_cast<const std::uint8_t*>(labels.data()), labels.size()};
}

}  // namespace

const Cells& Result::Implementation::cells() {
  if (cells_) return *cells_;
  whole_ = united(result.mesh);
  const geometry::CellBatch& all = *whole_;
  return cells_.emplace(Cells{.dimension = result.report.dimension,
                              .points = all.points,
                              .point_offset = all.point_offset,
                              .face_offset = all.facet_offset,
                              .face_vertex_offset = all.facet_vertex_offset,
                              .face_vertices = all.facet_vertices,
                              .labels = bytes_of(all.label),
                              .primitives = all.primitive,
                              .parts = all.part,
                              .regions = all.region,
                              .levels = all.level,
                              .volumes = all.volume});
}

Figures Result::Implementation::figures() const {
  Figures figures = api::figures_in(result.report);
  figures.written = written.files;
  figures.solver_mesh = written.solver_mesh;
  figures.drawing = written.drawing;
  return figures;
}

const Measures& Result::Implementation::measures() {
  if (!measures_) measures_ = api::measures_of(result.report);
  return *measures_;
}

void Result::Implementation::check_cells(const std::string& what) const {
  if (result.report.interrupted)
    throw Error("cannot make " + what + ": the evaluation was stopped, and there are no cells");
  if (!holds_cells || !result.report.has_cells)
    throw Error("cannot make " + what +
                ": no cells are held; evaluate without measures_only, surface_only and outputs_only");
}

const supersteps::Asked& Result::Implementation::asked() const {
  if (!result.asked) {
    if (result.report.interrupted) throw Error("the evaluation was stopped: there are no cells to ask");
    if (!ranks->ranks.is_master()) throw Error("this is asked of the master, which has all cells");
    if (!result.is_collected)
      throw Error(
          "the cells stay on the ranks that found them, so they can be asked no more; ask with the options "
          "of the evaluation (surface, faces, contacts)");
    throw Error("no cells are held: evaluate without measures_only, surface_only and outputs_only");
  }
  return *result.asked;
}

void Result::Implementation::find_surface(bool with_faces) {
  if (result.boundary && (result.faces || !with_faces)) return;
  if (result.report.dimension != 3)
    throw Error("surfaces are found for solids of dimension 3, not " +
                std::to_string(result.report.dimension));
  if (!result.keeps_in) throw Error("the IN cells have the surface: evaluate with keep_in");
  if (result.boundary && !result.asked)
    throw Error(
        "the surface is there, but not its faces, which files for CAD programs, and of parts for printers, "
        "hold, and there are no cells left to find them from: evaluate with the option 'faces'");
  asked().find_boundary(result, with_faces);
}

void Result::Implementation::find_outlines() {
  if (result.outlines) return;
  if (!result.keeps_in) throw Error("the IN cells have the outline: evaluate with keep_in");
  asked().find_boundary(result, false);
}

int Result::dimension() const { return implementation_->result.report.dimension; }
bool Result::is_complete() const { return implementation_->result.report.complete; }
bool Result::is_interrupted() const { return implementation_->result.report.interrupted; }
bool Result::is_of_master() const { return implementation_->ranks->ranks.is_master(); }
bool Result::is_collected() const { return implementation_->result.is_collected; }
bool Result::has_cells() const {
  const auto& report = implementation_->result.report;
  return implementation_->holds_cells && report.has_cells && !report.interrupted;
}
std::string Result::digest() const {
  const auto& report = implementation_->result.report;
  return report.has_cells ? report.digest : std::string();
}
const Cells& Result::cells() const {
  return guarded([&]() -> const Cells& { return implementation_->cells(); });
}
const Measures& Result::measures() const {
  return guarded([&]() -> const Measures& { return implementation_->measures(); });
}

std::map<std::string, Measures> Result::named_measures() const {
  std::map<std::string, Measures> all;
  for (const auto& each : implementation_->result.report.measures)
    all.emplace(each.name, api::measures_of(each));
  return all;
}

std::pair<Vector, Vector> Result::bounds() const {
  const auto& report = implementation_->result.report;
  return {report.lower, report.upper};
}

std::vector<Part> Result::parts() const { return api::parts_of(implementation_->result.report); }

Surface Result::surface() const {
  return guarded([&] {
    implementation_->find_surface();
    const geometry::TriangleSurface& found = *implementation_->result.boundary;
    const supersteps::BoundaryReport& figures = *implementation_->result.report.boundary;
    return Surface{.points = flat(found.points),
                   .triangles = flat(found.triangles),
                   .parts = found.owner,
                   .area = figures.area,
                   .closed = figures.closed,
                   .digest = figures.digest,
                   .owner = implementation_};
  });
}

std::vector<Contact> Result::contacts() const {
  return guarded([&] {
    auto& result = implementation_->result;
    if (result.report.dimension != 3)
      throw Error("contacts are found for solids of dimension 3, not " +
                  std::to_string(result.report.dimension));
    if (!implementation_->has_contacts) {
      result.contacts = implementation_->asked().contacts(result);
      implementation_->has_contacts = true;
    }
    std::vector<Contact> contacts;
    contacts.reserve(result.contacts.size());
    for (const auto& each : result.contacts) contacts.push_back({each.cell, each.facet, each.area});
    return contacts;
  });
}

Locations Result::locate(std::span<const double> points) const {
  return guarded([&] {
    const auto& result = implementation_->result;
    const supersteps::Asked& asked = implementation_->asked();
    if (!result.keeps_in || !result.keeps_fuzzy)
      throw Error(
          "to tell where points are takes all IN and FUZZY cells: evaluate with keep_in and keep_fuzzy");
    const auto d = static_cast<std::size_t>(result.report.dimension);
    if (points.size() % d != 0)
      throw Error("locate: " + counted(points.size(), "# number[s] [is|are] no points of ") +
                  counted(d, "# dimension[s]"));
    for (const double x : points)
      if (!(x >= -1e150 && x <= 1e150))
        throw Error("locate: a point is too far away to tell its distance (beyond 1e150)");
    Locations found;
    for (const supersteps::Answer& answer : asked.locate(result, points)) {
      found.labels.push_back(static_cast<std::uint8_t>(answer.label));
      found.primitives.push_back(answer.primitive);
      found.parts.push_back(answer.part);
      found.distances.push_back(answer.label == geometry::Label::in ? -answer.distance : answer.distance);
      found.nearest.insert(found.nearest.end(), answer.nearest.begin(), answer.nearest.end());
    }
    return found;
  });
}

std::vector<std::string> Result::write(const std::filesystem::path& path, const WriteOptions& options) const {
  return guarded([&] { return implementation_->write(path, options); });
}
std::string Result::picture(const std::string& format, const View& view) const {
  return guarded([&] { return implementation_->picture(format, view); });
}
void Result::animate(const std::filesystem::path& path, const Film& film, const View& view) const {
  guarded([&] { implementation_->animate(path, film, view); });
}
Figures Result::figures() const {
  return guarded([&] { return implementation_->figures(); });
}
std::string Result::report() const {
  const auto& mesh = implementation_->written.solver_mesh;
  return guarded([&] { return api::to_json(implementation_->result.report, mesh ? &*mesh : nullptr); });
}

std::vector<std::string> Result::warnings() const {
  std::vector<std::string> all = implementation_->result.report.warnings;
  for (const auto& failed : implementation_->result.report.failed) all.push_back(failed.text);
  return all;
}
std::vector<std::string> Result::notes() const { return implementation_->result.report.notes; }

}  // namespace bsp2
