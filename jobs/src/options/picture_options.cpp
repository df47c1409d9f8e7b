#include "options/picture_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "options/checks.hpp"

namespace bsp2::jobs {
namespace {

namespace fs = std::filesystem;

constexpr int largest_size = 8192;

std::optional<std::array<double, 3>> eye_of_picture(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto numbers = numbers_in(text, ',');
  if (numbers.size() == 2)
    throw Error("--eye: '" + text +
                "' has two numbers; models in the plane are seen from straight above, without --eye, and "
                "--look X,Y tells what is in the middle of the picture");
  if (numbers.size() != 3)
    throw Error("--eye: '" + text + "' is no point; write three numbers, for example --eye 30,-40,25");
  return std::array{numbers[0], numbers[1], numbers[2]};
}

/// In the plane z = 0 it may be left out.
std::optional<std::array<double, 3>> middle_of_picture(const std::string& text) {
  if (text.empty()) return std::nullopt;
  auto numbers = numbers_in(text, ',');
  if (numbers.size() == 2) numbers.push_back(0);
  if (numbers.size() != 3)
    throw Error("--look: '" + text +
                "' is no point; write three numbers, for example --look 30,-40,25, or two "
                "in the plane");
  return std::array{numbers[0], numbers[1], numbers[2]};
}

/// A factor, or two with a colon between them.
CLI::Validator is_explosion() {
  constexpr double most = 100;
  return {[](const std::string& text) -> std::string {
            const auto factors = numbers_in(text, ':');
            const bool are_factors = (factors.size() == 1 || factors.size() == 2) &&
                                     std::all_of(factors.begin(), factors.end(),
                                                 [](double factor) { return factor >= 0 && factor <= most; });
            return are_factors ? "" : "must be a number, 0 .. 100, not '" + text + "'";
          },
          "0 .. 100"};
}

}  // namespace

std::vector<double> numbers_in(const std::string& text, char between) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(between, at), text.size());
    double number = 0;
    if (!CLI::detail::lexical_cast(text.substr(at, end - at), number) || !std::isfinite(number)) return {};
    numbers.push_back(number);
    at = end + 1;
  }
  return numbers;
}

void add_picture_options(CLI::App& app, PictureText& text) {
  const auto group = "How pictures look";
  app.add_option("--eye", text.eye,
                 "draw in perspective, seen from here (default: a\nparallel projection from the front, right "
                 "and above)")
      ->type_name("X,Y,Z")
      ->group(group);
  app.add_option("--look", text.look, "what is in the middle of the picture")
      ->type_name("X,Y,Z")
      ->group(group);
  app.add_option(
         "--explode", text.explode,
         "move the regions apart: each by F times its way\nfrom the middle (in an animation also A:B)")
      ->check(is_explosion())
      ->type_name("F")
      ->group(group);
  app.add_option("--edges", text.edges,
                 "draw edges: feature (those of the solid), cells\n(without a word, too), or none (default)")
      ->expected(0, 1)
      ->default_str("cells")
      ->check(is_one_of({"none", "feature", "cells"}))
      ->type_name("WHICH")
      ->group(group);
  app.add_option("--shade", text.shade,
                 "what colours tell: part, rank, region, label,\nlevel, or colour (the model's own; default)")
      ->check(is_one_of({"part", "rank", "region", "label", "level", "colour", "color"}))
      ->type_name("WHAT")
      ->group(group);
  app.add_flag("--no-legend", text.no_legend, "do not write what the colours tell")->group(group);
  app.add_flag("--axes", text.axes, "draw where the axes point, and the scale")->group(group);
  app.add_flag("--transparent", text.transparent, "without a background")->group(group);
  app.add_option("--size", text.size, "pixels (default: 1000x1000)")->type_name("WxH")->group(group);
}

std::vector<std::string> with_edges(std::vector<std::string> arguments) {
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i)
    if (arguments[i] == "--edges" && arguments[i + 1].find_first_of("./\\") != std::string::npos)
      arguments[i] = "--edges=cells";
  return arguments;
}

bool is_given(const PictureText& text) {
  return !text.eye.empty() || !text.look.empty() || !text.size.empty() || !text.shade.empty() ||
         !text.explode.empty() || !text.edges.empty() || text.no_legend || text.axes || text.transparent;
}

std::vector<double> eye_of(const std::string& text) {
  std::vector<double> eye = numbers_in(text, ',');
  if (eye.empty())
    throw Error(
        "--eye: '" + text +
        "' is no point; write as many numbers as the model has dimensions, for example --eye 30,-40,25");
  return eye;
}

View view_of(const PictureText& text) {
  View view;
  view.eye = eye_of_picture(text.eye);
  view.look = middle_of_picture(text.look);
  if (view.eye && view.look && *view.eye == *view.look)
    throw Error("--eye and --look are the same point: the picture needs a direction");
  if (const auto factors = numbers_in(text.explode, ':'); factors.size() == 1) view.explode = factors[0];
  if (!text.edges.empty()) view.edges = text.edges;
  if (!text.shade.empty()) view.shade = text.shade;
  view.legend = !text.no_legend;
  view.axes = text.axes;
  view.transparent = text.transparent;
  if (text.size.empty()) return view;
  const auto numbers = numbers_in(text.size, 'x');
  const auto is_size = [](double n) { return n >= 1 && n <= largest_size && n == std::trunc(n); };
  if (numbers.size() != 2 || !is_size(numbers[0]) || !is_size(numbers[1]))
    throw Error("--size: '" + text.size +
                "' is no size; write width x height in pixels, for example 1600x1200, each up to " +
                std::to_string(largest_size));
  view.width = static_cast<int>(numbers[0]);
  view.height = static_cast<int>(numbers[1]);
  return view;
}

void check_picture(const fs::path& path, const std::string& option) {
  if (!file_format(path).picture)
    throw Error(option + ": '" + path.string() + "' must end in .png, .svg or .pdf");
}

}  // namespace bsp2::jobs
