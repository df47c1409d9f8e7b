#pragma once

#include <string>

#include "options/command_line.hpp"
#include "options/film_options.hpp"
#include "options/picture_options.hpp"
#include "options/work_options.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// What a picture or an animation is of, and how it looks, as it is typed.
struct RenderText {
  std::string input, output;
  PictureText view;
  FilmText film;
};

/// Adds `bsp2 render`.
CLI::App* add_render_command(CLI::App& app, RunCommand& command, RenderText& text, WorkText& work);

/// After parsing. @throws bsp2::Error for what makes no sense.
void choose_rendering(const RenderText& text, RunCommand& command);

}  // namespace bsp2::jobs
