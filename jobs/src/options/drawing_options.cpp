#include "options/drawing_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <set>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "options/checks.hpp"

namespace bsp2::jobs {
namespace {

using drawing::DrawingOptions;

constexpr auto draw_footer =
    "Examples:\n"
    "  bsp2 draw part.csg -o part.pdf -o part.dxf\n"
    "\n"
    "  bsp2 draw part.csg -o part.svg --section A=x:10 --dimension front:0,0,0:40,0,0\n"
    "A unit of the model is a millimetre. Layers: VISIBLE, SMOOTH, HIDDEN, SECTION,\n"
    "CENTER, DIMENSION, FRAME.";

std::vector<std::string> words_in(const std::string& text, char between) {
  return CLI::detail::split(text, between);
}

double number_in(const std::string& text, const std::string& mistake) {
  double number = 0;
  if (!CLI::detail::lexical_cast(text, number) || !std::isfinite(number)) throw Error(mistake);
  return number;
}

drawing::ViewKind view_in(const std::string& name, const std::string& option) {
  const auto view = drawing::view_named(name);
  if (!view)
    throw Error(option + ": there is no view '" + name +
                "'; front, back, left, right, top, bottom and iso are");
  return *view;
}

std::vector<drawing::ViewKind> views_in(const std::string& text) {
  std::vector<drawing::ViewKind> views;
  for (const std::string& name : words_in(text, ',')) {
    const auto view = view_in(name, "--views");
    if (std::find(views.begin(), views.end(), view) != views.end())
      throw Error("--views: '" + name + "' is named twice");
    views.push_back(view);
  }
  return views;
}

/// "1:2" or "2:1".
std::optional<double> scale_in(const std::string& text) {
  if (text.empty() || text == "auto") return std::nullopt;
  const std::string mistake = "--scale: '" + text + "' is no scale; write for example 1:2, 5:1 or auto";
  const auto sides = words_in(text, ':');
  if (sides.size() != 2) throw Error(mistake);
  const double on_paper = number_in(sides[0], mistake), in_model = number_in(sides[1], mistake);
  if (!(on_paper > 0 && in_model > 0)) throw Error(mistake);
  return on_paper / in_model;
}

/// "A=x:10", or "A=-x:10" from behind.
drawing::Section section_in(const std::string& text) {
  const std::string mistake =
      "--section: '" + text +
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
drawing::Dimension dimension_in(const std::string& text) {
  const std::string mistake = "--dimension: '" + text +
                              "' is no dimension; write a view and two points of the model, for example "
                              "front:0,0,0:40,0,0";
  const auto words = words_in(text, ':');
  if (words.size() != 3) throw Error(mistake);
  return {view_in(words[0], "--dimension"), point_in(words[1], mistake), point_in(words[2], mistake)};
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  std::array<char, 16> text;
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts);
  return text.data();
}

void add_view_options(CLI::App& app, DrawingOptions& options, DrawingText& text) {
  const auto group = "What is drawn";
  app.add_option("--views", text.views,
                 "which views: front, back, left, right, top, bottom,\niso (default: front,top,left,iso)")
      ->type_name("VIEW,...")
      ->group(group);
  app.add_option(
         "--section", text.sections,
         "cut at a plane and look at what is behind it,\nhatched by part: A=x:10; A=-x:10 the other way; "
         "repeat\nfor several")
      ->allow_extra_args(false)
      ->type_name("NAME=PLANE")
      ->group(group);
  app.add_option("--dimension", text.dimensions,
                 "the distance of two points of the model, as a view\nshows it: front:0,0,0:40,0,0; repeat "
                 "for several")
      ->allow_extra_args(false)
      ->type_name("DISTANCE")
      ->group(group);
  app.add_option(
         "--hidden", text.hidden,
         "edges behind faces: dashed, none, or all: dashed in the\npictorial view as well (default: dashed)")
      ->check(is_one_of({"all", "dashed", "none"}))
      ->type_name("HOW")
      ->group(group);
  app.add_option("--smooth", text.smooth,
                 "edges between facets of what is round: none or thin\n(default: none)")
      ->check(is_one_of({"none", "thin"}))
      ->type_name("HOW")
      ->group(group);
  app.add_option("--smooth-angle", options.smooth_angle, "facets that meet in less are of something round")
      ->check(is_number(0.0, 180.0, "0 .. 180"))
      ->type_name("DEGREES")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--no-centre-lines", text.no_centre_lines, "draw no axes of what is round")->group(group);
  app.add_flag("--no-size", text.plain, "write no overall dimensions")->group(group);
}

void add_sheet_options(CLI::App& app, DrawingOptions& options, DrawingText& text) {
  const auto group = "The sheet";
  app.add_option("--sheet", text.sheet, "A4, A3, A2, A1 or A0 (default: A3)")
      ->check(is_one_of({"A4", "A3", "A2", "A1", "A0"}))
      ->type_name("SIZE")
      ->group(group);
  app.add_option("--scale", text.scale, "1:2, 5:1, ... (default: the largest usual one that\nfits)")
      ->type_name("SCALE")
      ->group(group);
  app.add_option("--projection", text.projection, "where views lie: first or third angle (default: first)")
      ->check(is_one_of({"first", "third"}))
      ->type_name("ANGLE")
      ->group(group);
  const auto add = [&](const char* name, std::string& value, const char* description) {
    app.add_option(name, value, description)->type_name("TEXT")->group(group);
  };
  add("--title", options.title, "title (default: the name of the model)");
  add("--author", options.author, "who has drawn it");
  add("--number", options.number, "number of the drawing");
  add("--material", options.material, "of what it is made");
  add("--date", options.date, "date (default: today)");
}

}  // namespace

CLI::App* add_draw_command(CLI::App& app, RunCommand& command, DrawingText& text) {
  DrawingOptions& options = command.drawing.emplace().options;
  CLI::App* draw = app.add_subcommand("draw", "Make an engineering drawing");
  draw->add_option("MODEL", command.options.model, "the model: a .csg or .scad file, or a snapshot (.h5)")
      ->required()
      ->check(is_named())
      ->type_name("");
  draw->add_option("-o,--output", text.files, "the drawing: .svg, .pdf or .dxf; repeat for several")
      ->required()
      ->check(is_named())
      ->allow_extra_args(false)
      ->type_name("FILE");
  add_view_options(*draw, options, text);
  add_sheet_options(*draw, options, text);
  draw->add_flag("--quiet", command.quiet, "tell neither scale nor progress");
  draw->footer(draw_footer);
  return draw;
}

void choose_drawing(const DrawingText& text, RunCommand& command) {
  DrawCommand& draw = *command.drawing;
  DrawingOptions& options = draw.options;
  for (const std::string& file : text.files) {
    if (!io::sheet_format(file)) throw Error("-o: '" + file + "' must end in .svg, .pdf or .dxf");
    draw.files.emplace_back(file);
  }
  if (!text.views.empty()) options.views = views_in(text.views);
  if (text.projection == "third") options.projection = drawing::Projection::third;
  options.scale = scale_in(text.scale);
  if (!text.sheet.empty()) options.size = drawing::sheet_size(text.sheet).value();
  if (text.hidden == "none") options.hidden = drawing::HiddenLines::nowhere;
  if (text.hidden == "all") options.hidden = drawing::HiddenLines::everywhere;
  options.smooth_edges = text.smooth == "thin";
  options.centre_lines = !text.no_centre_lines;
  options.overall = !text.plain;
  std::set<std::string> names;
  for (const std::string& section : text.sections) {
    options.sections.push_back(section_in(section));
    if (!names.insert(options.sections.back().name).second)
      throw Error("--section: two are called '" + options.sections.back().name + "'");
  }
  for (const std::string& each : text.dimensions) options.dimensions.push_back(dimension_in(each));
  if (options.title.empty()) options.title = command.options.model.stem().string();
  if (options.date.empty()) options.date = today();
  command.options.boundary = command.options.faces = true;
  if (command.options.model.extension() == ".h5") {
    if (command.options.curved || command.options.parts_by_colour || command.options.tolerance ||
        command.options.coincidence != supersteps::RunOptions().coincidence)
      throw Error(
          "--curved, --parts, --coincidence and --tolerance are those of the snapshot: leave them out");
    command.options.resume = command.options.model;
    command.options.steps = 0;  // nothing is computed, only drawn as it is
    command.options.collect_cells = true;
  } else {
    command.options.surface_only = true;
  }
}

}  // namespace bsp2::jobs
