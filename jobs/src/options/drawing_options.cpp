#include "options/drawing_options.hpp"

#include <CLI/CLI.hpp>

#include "options/paths.hpp"

namespace bsp2::jobs {
namespace {

constexpr auto draw_footer =
    "Examples:\n"
    "  bsp2 draw part.csg -o part.pdf -o part.dxf\n"
    "\n"
    "  bsp2 draw part.csg -o part.svg --section A=x:10 --dimension front:0,0,0:40,0,0\n"
    "A unit of the model is a millimetre. Layers: VISIBLE, SMOOTH, HIDDEN, SECTION,\n"
    "CENTER, DIMENSION, FRAME.";

void add_view_options(CLI::App& app, DrawingText& text) {
  const auto group = "What is drawn";
  app.add_option("--views", text.views_in_one,
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
  app.add_option("--smooth-angle", text.smooth_angle, "facets that meet in less are of something round")
      ->check(is_number(0.0, 180.0, "0 .. 180"))
      ->type_name("DEGREES")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--no-centre-lines", text.no_centre_lines, "draw no axes of what is round")->group(group);
  app.add_flag("--no-size", text.plain, "write no overall dimensions")->group(group);
}

void add_sheet_options(CLI::App& app, DrawingText& text) {
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
  add("--title", text.title, "title (default: the name of the model)");
  add("--author", text.author, "who has drawn it");
  add("--number", text.number, "number of the drawing");
  add("--material", text.material, "of what it is made");
  add("--date", text.date, "date (default: today)");
}

}  // namespace

CLI::App* add_draw_command(CLI::App& app, RunCommand& command, DrawingText& text) {
  command.options.outputs.drawing.emplace();
  text.title.clear();
  CLI::App* draw = app.add_subcommand("draw", "Make an engineering drawing");
  add_input(*draw, "MODEL|SNAPSHOT", text.input, model_or_snapshot_words);
  draw->add_option("-o,--output", text.files, "the drawing: .svg, .pdf or .dxf; repeat for several")
      ->required()
      ->check(is_named())
      ->allow_extra_args(false)
      ->type_name("FILE");
  add_view_options(*draw, text);
  add_sheet_options(*draw, text);
  draw->add_flag("--quiet", command.quiet, "tell neither scale nor progress");
  draw->footer(draw_footer);
  return draw;
}

void choose_drawing(const DrawingText& text, RunCommand& command) {
  DrawingOutput& draw = *command.options.outputs.drawing;
  for (const std::string& file : text.files) {
    if (!file_format(file).drawing) throw Error("-o: '" + file + "' must end in .svg, .pdf or .dxf");
    draw.files.emplace_back(file);
  }
  DrawingOptions words = text;
  if (!text.views_in_one.empty()) words.views = CLI::detail::split(text.views_in_one, ',');
  words.centre_lines = !text.no_centre_lines;
  words.overall = !text.plain;
  if (words.title.empty()) words.title = std::filesystem::path(text.input).stem().string();
  check(words, "--");
  draw.drawing = words;
  choose_input(command, text.input);
  command.options.surface_only = !command.resume;
}

}  // namespace bsp2::jobs
