#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// The options of a picture as they are typed: one home for all commands that draw.
struct PictureText {
  std::string eye, look, size, shade, explode, edges;
  bool no_legend = false, axes = false, transparent = false;
};

/// Adds --eye, --look, --explode, --edges, --shade, --size and the like to a command.
void add_picture_options(CLI::App& app, PictureText& text);

/// Arguments in which `--edges` has its word where a file follows it: that is no word of it.
std::vector<std::string> with_edges(std::vector<std::string> arguments);

/// Was any of them given?
bool is_given(const PictureText& text);

/// Numbers with something between them; empty if that is not what the text is.
std::vector<double> numbers_in(const std::string& text, char between);

/// The point that --eye names, in any dimension. @throws bsp2::Error if it names none.
std::vector<double> eye_of(const std::string& text);

/// What they mean. @throws bsp2::Error for points, sizes and endings that make no sense.
View view_of(const PictureText& text);

/// @param option that names a picture's file, for the message. @throws bsp2::Error if its ending names none.
void check_picture(const std::filesystem::path& path, const std::string& option);

}  // namespace bsp2::jobs
