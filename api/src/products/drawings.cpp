#include "bsp2/api/products/drawings.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>
#include <set>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "products/shared_lines.hpp"

namespace bsp2::api {
namespace {

std::vector<std::string> words_in(const std::string& text, char between) {
  std::vector<std::string> words{""};
  for (const char letter : text)
    if (letter == between)
      words.emplace_back();
    else
      words.back() += letter;
  return words;
}

double number_in(const std::string& text, const std::string& mistake) {
  double number = 0;
  const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
    throw Error(mistake);
  return number;
}

drawing::ViewKind view_in(const std::string& name, const std::string& option) {
  const auto view = drawing::view_named(name);
  if (!view)
    throw Error(option + ": there is no view '" + name +
                "'; front, back, left, right, top, bottom and iso are");
  return *view;
}

std::vector<drawing::ViewKind> views_in(const std::vector<std::string>& names, const std::string& option) {
  std::vector<drawing::ViewKind> views;
  for (const std::string& name : names) {
    const auto view = view_in(name, option);
    if (std::find(views.begin(), views.end(), view) != views.end())
      throw Error(option + ": '" + name + "' is named twice");
    views.push_back(view);
  }
  if (views.empty()) throw Error(option + ": a drawing needs a view");
  return views;
}

/// "1:2" or "2:1".
std::optional<double> scale_in(const std::string& text, const std::string& option) {
  if (text.empty() || text == "auto") return std::nullopt;
  const std::string mistake = option + ": '" + text + "' is no scale; write for example 1:2, 5:1 or auto";
  const auto sides = words_in(text, ':');
  if (sides.size() != 2) throw Error(mistake);
  const double on_paper = number_in(sides[0], mistake), in_model = number_in(sides[1], mistake);
  if (!(on_paper > 0 && in_model > 0)) throw Error(mistake);
  return on_paper / in_model;
}

/// "A=x:10", or "A=-x:10" from behind.
drawing::Section section_in(const std::string& text, const std::string& option) {
  const std::string mistake =
      option + ": '" + text +
      "' is no section; write a name, an axis and where on it, for example A=x:10, or A=-x:10 "
      "to look the other way";
  const auto named = words_in(text, '=');
  if (named.size() != 2 || named[0].empty() || named[0].size() > 3) throw Error(mistake);
  auto plane = words_in(named[1], ':');
  if (plane.size() != 2) throw Error(mistake);
  drawing::Section section;
  section.name = named[0];
  section.from_behind = plane[0].starts_with('-');
  if (section.from_behind) plane[0].erase(0, 1);
  if (plane[0] != "x" && plane[0] != "y" && plane[0] != "z") throw Error(mistake);
  section.axis = static_cast<std::size_t>(plane[0][0] - 'x');
  section.place = number_in(plane[1], mistake);
  return section;
}

drawing::Point3 point_in(const std::string& text, const std::string& mistake) {
  const auto numbers = words_in(text, ',');
  if (numbers.size() != 3) throw Error(mistake);
  return {number_in(numbers[0], mistake), number_in(numbers[1], mistake), number_in(numbers[2], mistake)};
}

/// "front:0,0,0:40,0,0".
drawing::Dimension dimension_in(const std::string& text, const std::string& option) {
  const std::string mistake = option + ": '" + text +
                              "' is no dimension; write a view and two points of the model, for example "
                              "front:0,0,0:40,0,0";
  const auto words = words_in(text, ':');
  if (words.size() != 3) throw Error(mistake);
  return {view_in(words[0], option), point_in(words[1], mistake), point_in(words[2], mistake)};
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  std::array<char, 16> text;
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts);
  return text.data();
}

/// One of some words. @throws Error that names them.
void check_word(const std::string& word, const std::vector<std::string>& words, const std::string& option) {
  if (std::find(words.begin(), words.end(), word) != words.end()) return;
  std::string all;
  for (const std::string& each : words) all += (all.empty() ? "" : ", ") + each;
  throw Error(option + ": '" + word + "' is none of " + all);
}

/// What runs the model once more, whole: its text, which only the master needs, and what a snapshot says of
/// it.
supersteps::RunOptions options_of_model(const supersteps::RunOptions& options, bool is_master) {
  supersteps::RunOptions again = options;
  again.on_cells = {};
  again.on_frame = {};
  again.snapshot.reset();  // which is of the model
  again.contacts = false;
  again.budget_seconds.reset();
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

void check_place(const drawing::Section& section, const Box& solid, const std::string& option) {
  const double lower = solid.lower.at(section.axis), upper = solid.upper.at(section.axis);
  if (section.place > lower && section.place < upper) return;
  throw Error(fmt::format(
      "{0}: the plane {1} = {2} does not cut the solid, which is between {1} = {3:.6g} and {1} = {4:.6g}",
      option, "xyz"[section.axis], section.place, lower, upper));
}

/// The solid without what is in front of a section. @param again runs all of it. Collective.
geometry::Brep cut(const drawing::Section& section, supersteps::RunOptions again, const Box& solid,
                   supersteps::Ranks& ranks, const Run& run, const std::string& option) {
  again.text = std::make_shared<const std::string>("difference() { group() {" + *again.text + "\n} " +
                                                   box_in_front(section, solid) + "}\n");
  supersteps::RunResult result = run(again, ranks);
  geometry::Brep faces;
  ranks.agree([&] {
    if (result.report.interrupted) throw Error("interrupted; nothing is drawn");
    if (!ranks.is_master()) return;
    if (!result.faces || result.faces->points.empty())
      throw Error(option + ": nothing is left behind the plane");
    const Box rest = box_of(*result.faces);
    const double least = section.place - 1e-9 * (solid.upper[section.axis] - solid.lower[section.axis]),
                 most = 2 * section.place - least;
    if (is_front_above(section) ? rest.upper[section.axis] > most : rest.lower[section.axis] < least)
      throw Error(
          option +
          ": the model has a modifier '!', which leaves nothing but what it marks, so it cannot be cut");
    faces = std::move(*result.faces);
  });
  return faces;
}

}  // namespace

drawing::DrawingOptions drawing_options(const DrawingOptions& words, std::string_view dashes) {
  const std::string before(dashes);
  drawing::DrawingOptions options;
  options.views = views_in(words.views, before + "views");
  check_word(words.projection, {"first", "third"}, before + "projection");
  if (words.projection == "third") options.projection = drawing::Projection::third;
  options.scale = scale_in(words.scale, before + "scale");
  check_word(words.sheet, {"A4", "A3", "A2", "A1", "A0"}, before + "sheet");
  options.size = drawing::sheet_size(words.sheet).value();
  check_word(words.hidden, {"all", "dashed", "none"}, before + "hidden");
  if (words.hidden == "none") options.hidden = drawing::HiddenLines::nowhere;
  if (words.hidden == "all") options.hidden = drawing::HiddenLines::everywhere;
  check_word(words.smooth, {"none", "thin"}, before + "smooth");
  options.smooth_edges = words.smooth == "thin";
  if (!(words.smooth_angle >= 0 && words.smooth_angle <= 180))
    throw Error(before + "smooth-angle: it is from 0 to 180 degrees");
  options.smooth_angle = words.smooth_angle;
  options.centre_lines = words.centre_lines;
  options.overall = words.overall;
  std::set<std::string> names;
  for (const std::string& section : words.sections) {
    options.sections.push_back(section_in(section, before + "section"));
    if (!names.insert(options.sections.back().name).second)
      throw Error(before + "section: two are called '" + options.sections.back().name + "'");
  }
  for (const std::string& each : words.dimensions)
    options.dimensions.push_back(dimension_in(each, before + "dimension"));
  options.title = words.title;
  options.author = words.author;
  options.number = words.number;
  options.material = words.material;
  options.date = words.date.empty() ? today() : words.date;
  return options;
}

drawing::Drawing draw(const supersteps::RunOptions& run_options, drawing::DrawingOptions options,
                      const supersteps::RunResult& result, supersteps::Ranks& ranks, const Run& run,
                      std::string_view dashes) {
  const auto option = [&](const drawing::Section& section) {
    return std::string(dashes) + "section " + section.name;
  };
  supersteps::RunOptions again;
  Box solid;  // the master's, whose text is the one that counts
  ranks.agree([&] {
    if (result.report.dimension != 3)
      throw Error(fmt::format("solids of dimension 3 are drawn, not {}{}", result.report.dimension,
                              result.report.dimension == 2 && !dashes.empty()
                                  ? "; 'bsp2 run MODEL --boundary FILE' writes the outline of a plane model"
                                  : ""));
    if (!options.sections.empty()) again = options_of_model(run_options, ranks.is_master());
    if (!ranks.is_master()) return;
    if (!result.faces || result.faces->points.empty())
      throw Error("there is nothing to draw: " + supersteps::why_nothing_is_in(result.report));
    solid = box_of(*result.faces);
    for (const auto& section : options.sections) check_place(section, solid, option(section));
  });
  std::vector<geometry::Brep> cuts;
  for (const auto& section : options.sections)
    cuts.push_back(cut(section, again, solid, ranks, run, option(section)));
  drawing::Drawing drawn;
  ranks.begin("drawing");
  options.threads = std::max(1U, result.report.threads);
  const auto lines = shared_lines(ranks.is_master() ? &*result.faces : nullptr, cuts, options, ranks);
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    drawn = drawing::draw(*result.faces, cuts, options, lines);
    if (run_options.resume && !result.report.complete)
      drawn.notes.emplace_back(
          "the snapshot is of a run that is not complete: only its IN cells are drawn" +
          std::string(options.sections.empty() ? "" : ", and the whole model in sections"));
  });
  return drawn;
}

std::vector<std::string> warnings_of_drawing(const supersteps::RunResult& result) {
  if (!result.faces || result.faces->is_closed) return {};
  return {
      "the faces do not bound solids everywhere, so lines may be missing or shown that are hidden. This is a "
      "mistake of bsp2: please report the model"};
}

}  // namespace bsp2::api
