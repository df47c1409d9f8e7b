#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/supersteps/render/rendering.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// How an animation moves; all at once, from the first picture to the last.
struct FilmCommand {
  unsigned count = 100;  ///< of pictures
  double rate = 25;      ///< a second
  bool turns = false;    ///< once around
  bool grows = false;    ///< from the first cuts to all
  /// Where the viewer goes: an eye, and what is looked at.
  struct Stand {
    std::array<double, 3> eye;
    std::optional<std::array<double, 3>> look;
  };
  std::vector<Stand> path;
  std::optional<std::array<double, 2>> explode;
  struct Sweep {
    int axis;
    double from, to;
  };
  std::optional<Sweep> sweep;
};

/// The options of an animation as they are typed.
struct FilmText {
  unsigned turntable = 0, count = 0;
  double rate = 0;
  std::string path, sweep;
  bool grow = false;
};

void add_film_options(CLI::App& app, FilmText& text);

/// What they mean. @param explode of the pictures as it is typed. @return nothing if no animation is asked
/// for.
/// @throws bsp2::Error for what makes no sense, with the file and the line of a path.
std::optional<FilmCommand> film_command(const FilmText& text, const std::string& explode,
                                        const std::filesystem::path& output);

/// Picture number `i` of an animation. @param most_level of the cells.
supersteps::PictureOptions view_of(const FilmCommand& film, supersteps::PictureOptions view, unsigned i,
                                   unsigned most_level);

}  // namespace bsp2::jobs
