#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "bsp2/bsp2.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

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
std::optional<Film> film_of(const FilmText& text, const std::string& explode,
                            const std::filesystem::path& output);

}  // namespace bsp2::jobs
