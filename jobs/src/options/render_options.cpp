#include "options/render_options.hpp"

#include <CLI/CLI.hpp>

#include "options/paths.hpp"

namespace bsp2::jobs {
namespace {

constexpr auto render_footer =
    "Examples:\n"
    "  bsp2 render run.h5 -o far.png --eye 60,-90,40 --size 2000x1500\n"
    "  bsp2 render model.csg -o turn.apng --turntable 120\n"
    "  bsp2 render run.h5 -o inside.mp4 --sweep-section y:-10:10 --count 200";

}  // namespace

CLI::App* add_render_command(CLI::App& app, RunCommand& command, RenderText& text, WorkText& work) {
  CLI::App* render = app.add_subcommand("render", "Make a picture or an animation");
  add_input(*render, "MODEL|SNAPSHOT", text.input, model_or_snapshot_words);
  add_path(*render, "-o,--output", text.output, "the picture: .png, .svg or .pdf; or an animation", "FILE")
      ->required();
  add_picture_options(*render, text.view);
  add_film_options(*render, text.film);
  add_solid_options(*render, command, work);
  add_tolerance_option(*render, command);
  add_threads_option(*render, command);
  render->add_flag("--quiet", command.quiet, "print no summary and no progress");
  render->footer(render_footer);
  return render;
}

void choose_rendering(const RenderText& text, RunCommand& command) {
  Outputs& outputs = command.options.outputs;
  choose_input(command, text.input);
  outputs.view = view_of(text.view);
  outputs.picture = text.output;
  outputs.film = film_of(text.film, text.view.explode, text.output);
  if (!outputs.film) check_picture(*outputs.picture, "-o");
  if (!command.resume) return;
  if (!outputs.film) command.quiet = true;  // a film takes a while
  if (outputs.view.shade == "rank")
    throw Error(
        "--shade rank: a snapshot does not tell who computed its cells; draw them when they are computed, "
        "with 'bsp2 render MODEL' or 'bsp2 run --picture'");
}

}  // namespace bsp2::jobs
