#include "answers/drawings.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/model/expression/csg.hpp"

namespace bsp2::jobs {
namespace fs = std::filesystem;
namespace {

/// What runs the model once more, whole: its text, which only the master needs, and what a snapshot says of
/// it.
supersteps::RunOptions options_of_model(const supersteps::RunOptions& options, bool is_master) {
  supersteps::RunOptions again = options;
  again.on_cells = {};
  again.resume.reset();
  again.steps.reset();
  again.surface_only = again.boundary = again.faces = true;
  std::string text;
  if (options.resume) {
    io::SnapshotHead head = io::read_snapshot(*options.resume, io::SnapshotPart::head).head;
    text = std::move(head.source);
    again.model = head.model;  // what it names by relative paths is found from there
    again.coincidence = head.coincidence;
    again.curved = head.curved;
    again.parts_by_colour = head.parts_by_colour;
    if (head.tolerance > 0) again.tolerance = head.tolerance;
  } else if (is_master && !options.text) {
    text = model::is_scad(options.model) ? model::convert_scad(options.model).text
                                         : model::read_model_text(options.model);
  } else if (options.text) {
    text = *options.text;
  }
  again.text = std::make_shared<const std::string>(std::move(text));
  return again;
}

struct Box {
  drawing::Point3 lower{}, upper{};
};

Box box_of(const geometry::Brep& brep) {
  Box box{brep.points.front(), brep.points.front()};
  for (const drawing::Point3& point : brep.points)
    for (std::size_t k = 0; k < 3; ++k) {
      box.lower[k] = std::min(box.lower[k], point[k]);
      box.upper[k] = std::max(box.upper[k], point[k]);
    }
  return box;
}

/// Who looks at z from the top has what is above in front, at x and y what is below.
bool is_front_above(const drawing::Section& section) { return (section.axis == 2) != section.from_behind; }

/// A box around all that is in front of a section, as text.
std::string box_in_front(const drawing::Section& section, const Box& solid) {
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k) size = std::max(size, solid.upper[k] - solid.lower[k]);
  std::array<double, 3> lower{}, length{};
  for (std::size_t k = 0; k < 3; ++k) {
    lower[k] = solid.lower[k] - size;
    length[k] = solid.upper[k] + size - lower[k];
  }
  // It begins at the plane, mirrored where it is below: a sum would be rounded.
  const bool is_above = is_front_above(section);
  std::array<int, 3> sign{1, 1, 1};
  lower[section.axis] = section.place;
  length[section.axis] = is_above ? solid.upper[section.axis] + size - section.place
                                  : section.place - (solid.lower[section.axis] - size);
  if (!is_above) sign[section.axis] = -1;
  return fmt::format("multmatrix([[{},0,0,{}],[0,{},0,{}],[0,0,{},{}],[0,0,0,1]]) cube(size=[{},{},{}]);",
                     sign[0], lower[0], sign[1], lower[1], sign[2], lower[2], length[0], length[1],
                     length[2]);
}

void check_place(const drawing::Section& section, const Box& solid) {
  const double lower = solid.lower.at(section.axis), upper = solid.upper.at(section.axis);
  if (section.place > lower && section.place < upper) return;
  throw Error(fmt::format(
      "--section {0}: the plane {1} = {2} does not cut the solid, which is between {1} = {3:.6g} and {1} "
      "= {4:.6g}",
      section.name, "xyz"[section.axis], section.place, lower, upper));
}

/// The solid without what is in front of a section. @param again runs all of it. Collective.
geometry::Brep cut(const drawing::Section& section, supersteps::RunOptions again, const Box& solid,
                   supersteps::Ranks& ranks, const Run& run) {
  again.text = std::make_shared<const std::string>("difference() { group() {" + *again.text + "\n} " +
                                                   box_in_front(section, solid) + "}\n");
  supersteps::RunResult result = run(again, ranks);
  geometry::Brep faces;
  ranks.agree([&] {
    if (result.report.interrupted) throw Error("interrupted; nothing is drawn");
    if (!ranks.is_master()) return;
    if (!result.faces || result.faces->points.empty())
      throw Error("--section " + section.name + ": nothing is left behind the plane");
    const Box rest = box_of(*result.faces);
    const double least = section.place - 1e-9 * (solid.upper[section.axis] - solid.lower[section.axis]),
                 most = 2 * section.place - least;
    if (is_front_above(section) ? rest.upper[section.axis] > most : rest.lower[section.axis] < least)
      throw Error(
          "--section " + section.name +
          ": the model has a modifier '!', which leaves nothing but what it marks, so it cannot be cut");
    faces = std::move(*result.faces);
  });
  return faces;
}

}  // namespace

void check_drawings(const RunCommand& command) {
  for (const fs::path& file : command.drawing->files) io::check_sheet(io::sheet_format(file).value());
}

void write_drawings(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks,
                    const Run& run, std::ostream& out) {
  if (!result.report.failed.empty()) return;  // the boundary could not be found, which is told
  drawing::DrawingOptions options = command.drawing->options;
  supersteps::RunOptions again;
  Box solid;  // the master's, whose text is the one that counts
  ranks.agree([&] {
    if (result.report.dimension != 3)
      throw Error(fmt::format("solids of dimension 3 are drawn, not {}{}", result.report.dimension,
                              result.report.dimension == 2
                                  ? "; 'bsp2 run MODEL --boundary FILE' writes the outline of a plane model"
                                  : ""));
    if (!options.sections.empty()) again = options_of_model(command.options, ranks.is_master());
    if (!ranks.is_master()) return;
    if (!result.faces || result.faces->points.empty())
      throw Error("the solid is empty: there is nothing to draw");
    solid = box_of(*result.faces);
    for (const auto& section : options.sections) check_place(section, solid);
  });
  std::vector<geometry::Brep> cuts;
  for (const auto& section : options.sections) cuts.push_back(cut(section, again, solid, ranks, run));
  ranks.agree([&] {
    ranks.begin("drawing");
    if (!ranks.is_master()) return;
    options.threads = result.report.threads;
    const drawing::Drawing drawn = drawing::draw(*result.faces, cuts, options);
    for (const fs::path& file : command.drawing->files) {
      if (command.on_writing) command.on_writing(file);
      io::make_folder(io::folder_of(file));
      io::write_file(file, io::sheet_bytes(drawn.sheet, io::sheet_format(file).value()));
    }
    if (!result.faces->is_closed)
      result.report.warnings.emplace_back(
          "the faces do not bound solids everywhere, so lines may be missing or shown that are hidden. This "
          "is a "
          "mistake of bsp2: please report the model");
    auto& notes = result.report.notes;
    notes.insert(notes.end(), drawn.notes.begin(), drawn.notes.end());
    if (command.options.resume && !result.report.complete)
      notes.emplace_back("the snapshot is of a run that is not complete: only its IN cells are drawn" +
                         std::string(options.sections.empty() ? "" : ", and the whole model in sections"));
    if (!command.quiet)
      out << fmt::format(
          "{} lines on {}, scale {}\n", drawn.sheet.paths.size(), options.size.name,
          drawn.scale >= 1 ? fmt::format("{:g}:1", drawn.scale) : fmt::format("1:{:g}", 1 / drawn.scale));
  });
}

}  // namespace bsp2::jobs
