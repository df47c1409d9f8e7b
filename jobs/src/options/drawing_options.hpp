#pragma once

#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "options/command_line.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// Options of a drawing as they are typed, before they mean something.
struct DrawingText : bsp2::DrawingOptions {
  std::string input, views_in_one;
  std::vector<std::string> files;
  bool plain = false, no_centre_lines = false;
};

/// Adds `bsp2 draw`; it writes into command.options.outputs.drawing, which exists from here on.
CLI::App* add_draw_command(CLI::App& app, RunCommand& command, DrawingText& text);

/// After parsing: what is drawn and where to, and what that needs of the run. @throws bsp2::Error for what
/// makes no sense.
void choose_drawing(const DrawingText& text, RunCommand& command);

}  // namespace bsp2::jobs
