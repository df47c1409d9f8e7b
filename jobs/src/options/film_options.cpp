#include "options/film_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "options/checks.hpp"
#include "options/picture_options.hpp"

namespace bsp2::jobs {
namespace {

namespace fs = std::filesystem;

constexpr unsigned most_pictures = 100000;

Film::Sweep sweep_of(const std::string& text) {
  const std::size_t axis =
      text.size() > 2 && text[1] == ':' ? std::string("xyz").find(text[0]) : std::string::npos;
  const auto ends = axis == std::string::npos ? std::vector<double>{} : numbers_in(text.substr(2), ':');
  if (ends.size() != 2)
    throw Error(
        "--sweep-section: '" + text +
        "' is no way of a section; write the axis and two places on it, for example --sweep-section x:0:100");
  return {static_cast<int>(axis), ends[0], ends[1]};
}

/// A line each: an eye, and what it looks at if that is not the middle.
std::vector<Film::Camera> path_in(const fs::path& file) {
  std::ifstream from(file);
  if (!from) throw Error("--path: cannot read '" + file.string() + "'");
  std::vector<Film::Camera> path;
  std::string line;
  for (int number = 1; std::getline(from, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> x;
    std::string word;
    bool is_wrong = false;
    while (words >> word) {
      double value = 0;
      is_wrong = is_wrong || !CLI::detail::lexical_cast(word, value) || !std::isfinite(value);
      x.push_back(value);
    }
    if (x.empty() && !is_wrong) continue;
    if (is_wrong || (x.size() != 3 && x.size() != 6))
      throw Error(file.string() + ":" + std::to_string(number) + ": '" + line +
                  "' is no camera; write the eye's three coordinates, and three of what it looks at if "
                  "that is not the middle");
    path.push_back({{x[0], x[1], x[2]}, {}});
    if (x.size() == 6) path.back().look = {x[3], x[4], x[5]};
    if (path.back().look == path.back().eye)
      throw Error(file.string() + ":" + std::to_string(number) +
                  ": the eye is where it looks: the picture needs a direction");
  }
  if (path.empty()) throw Error("--path: '" + file.string() + "' holds no camera");
  return path;
}

}  // namespace

void add_film_options(CLI::App& app, FilmText& text) {
  const auto group = "Animations (-o FILE.apng, .gif, .mp4 or .webm)";
  app.add_option("--turntable", text.turntable, "go once around the solid, in N pictures")
      ->check(is_number(1U, most_pictures, "1 .. 100000"))
      ->type_name("N")
      ->group(group);
  app.add_option("--path", text.path, "go along these cameras: on each line an eye, and\nwhat it looks at")
      ->check(is_named())
      ->type_name("FILE")
      ->group(group);
  app.add_option("--sweep-section", text.sweep,
                 "move a section through: what it has passed is cut\noff, for example x:0:100")
      ->type_name("WAY")
      ->group(group);
  app.add_flag("--grow", text.grow, "from the cells of the first cuts to all of them")->group(group);
  app.add_option("--count", text.count,
                 "pictures in all (default: those of --turntable or\n--path, else 100)")
      ->check(is_number(1U, most_pictures, "1 .. 100000"))
      ->type_name("N")
      ->group(group);
  app.add_option("--rate", text.rate, "pictures a second (default: 25)")
      ->check(is_number(0.01, 1000.0, "0.01 .. 1000"))
      ->type_name("N")
      ->group(group);
}

std::optional<Film> film_of(const FilmText& text, const std::string& explode, const fs::path& output) {
  Film film;
  film.turns = text.turntable > 0;
  film.grows = text.grow;
  if (const auto factors = numbers_in(explode, ':'); factors.size() == 2)
    film.explode = {factors[0], factors[1]};
  if (!text.sweep.empty()) film.sweep = sweep_of(text.sweep);
  if (!text.path.empty()) film.path = path_in(text.path);
  const bool moves = film.turns || film.grows || film.explode || film.sweep || !film.path.empty();
  if (!moves) {
    if (file_format(output).animation)
      throw Error(
          "'" + output.string() +
          "' is an animation: say how it moves, for example --turntable 120 (see 'bsp2 render --help')");
    if (text.count > 0 || text.rate > 0)
      throw Error("--count and --rate are for animations: say how it moves, for example --turntable 120");
    return std::nullopt;
  }
  if (film.turns && !film.path.empty())
    throw Error("--turntable and --path both say where the viewer goes: choose one");
  check_animation(output);
  if (!film.path.empty()) film.count = std::max(2U, static_cast<unsigned>(film.path.size()));
  if (film.turns) film.count = text.turntable;
  if (text.count > 0) film.count = text.count;
  if (text.rate > 0) film.rate = text.rate;
  return film;
}

}  // namespace bsp2::jobs
