#pragma once

#include <string>
#include <vector>

#include "options/command_line.hpp"
#include "options/picture_options.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// What a run writes.
namespace bsp2::jobs {

/// Its options as they are typed.
struct OutputText {
  std::string folder, picture, frames, report, table, collect, snapshot, series;
  PictureText view;
  std::vector<std::string> boundaries;
  bool cells = false, list_formats = false;
};

void add_output_options(CLI::App& app, RunCommand& command, OutputText& text);
/// `--list-formats` asks for the table of formats, and for nothing else.
CLI::Option* add_list_formats_option(CLI::App& app, OutputText& text);
CLI::Option* add_clean_option(CLI::App& app, RunCommand& command);

/// After parsing, and once it is known what is computed and what is only shown. @throws bsp2::Error for what
/// makes no sense.
void choose_outputs(const OutputText& text, RunCommand& command);

}  // namespace bsp2::jobs
