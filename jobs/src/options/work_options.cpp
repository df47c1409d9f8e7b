#include "options/work_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>

#include "options/checks.hpp"

namespace bsp2::jobs {
namespace {

CLI::Validator finite_share() {
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= 0 && value <= 0.01) return {};
            return "must be between 0 and 0.01, not " + text;
          },
          "0 .. 0.01"};
}

CLI::Validator positive_number() {
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value > 0 && std::isfinite(value)) return {};
            return "must be a length above 0, not " + text;
          },
          "> 0"};
}

CLI::Validator acute_angle() {
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value > 0 && value < 90) return {};
            return "must be an angle above 0 and below 90 degrees, not " + text;
          },
          "0 .. 90"};
}

void set_kept(Options& options, const std::vector<std::string>& keep) {
  if (keep.empty()) return;
  const auto named = [&](const char* label) {
    return std::find(keep.begin(), keep.end(), label) != keep.end();
  };
  options.keep_in = named("in");
  options.keep_fuzzy = named("fuzzy");
  options.keep_out = named("out");
}

}  // namespace

void add_solid_options(CLI::App& app, RunCommand& command, WorkText& text) {
  auto& options = command.options;
  const auto group = work_group;
  app.add_flag("--curved", options.curved,
               "take spheres, cylinders, circles as truly round:\nFUZZY cells hold their surfaces (see "
               "--tolerance)")
      ->group(group);
  app.add_option(
         "--parts", text.parts,
         "what the parts of the model are: named (its part\nnodes; default), or colour (each colour is one)")
      ->check(is_one_of({"named", "colour", "color"}))
      ->type_name("KIND")
      ->group(group);
  app.add_option("--coincidence", options.coincidence,
                 "planes closer than this share of the bounding box\nare one; 0: only equal planes")
      ->check(finite_share())
      ->type_name("T")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--strict", options.strict, "end with an error where there is a warning")->group(group);
}

void add_model_options(CLI::App& app, RunCommand& command, WorkText& text) {
  auto& options = command.options;
  const auto group = work_group;
  app.add_option("--regions", options.regions,
                 "divide space into N regions, rounded up to a power\nof two (default: chosen by the size of "
                 "the model)")
      ->check(is_number(1U, 1U << 20, "1 .. 1048576"))
      ->type_name("N")
      ->group(group);
  app.add_option(
         "--keep", text.keep,
         "keep only cells of this kind: in, fuzzy or out;\nrepeat for several (default: in and fuzzy)")
      ->check(is_one_of({"in", "fuzzy", "out"}))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("KIND")
      ->group(group);
  add_solid_options(app, command, text);
}

void add_threads_option(CLI::App& app, RunCommand& command, const char* group) {
  app.add_option("--threads", command.options.threads, "threads of this process; 0: one a core")
      ->check(is_number(0U, 4096U, "0 .. 4096"))
      ->type_name("N")
      ->group(group);
}

void add_tolerance_option(CLI::App& app, RunCommand& command) {
  const auto group = work_group;
  app.add_option("--tolerance", command.options.tolerance,
                 "refine what is round down to cells so thin\n"
                 "(default: a thousandth of the model, a sixteenth in\n"
                 "four dimensions, more above)")
      ->check(positive_number())
      ->type_name("H")
      ->group(group);
}

void add_level_option(CLI::App& app, RunCommand& command, const std::string& rest) {
  app.add_option("--level", command.options.level, "stop after N cuts in a row; the rest " + rest)
      ->check(is_number(0U, 65535U, "0 .. 65535"))
      ->type_name("N")
      ->group(work_group);
}

void add_budget_option(CLI::App& app, WorkText& text, const char* description) {
  app.add_option("--budget", text.budget, description)->type_name("TIME")->group(work_group);
}

void add_cells_option(CLI::App& app, RunCommand& command, const char* description) {
  app.add_option("--cells", command.options.cells, description)
      ->check(is_number(std::uint64_t{1}, std::uint64_t{1} << 62, "1 or more"))
      ->type_name("N")
      ->group(work_group);
}

void add_work_options(CLI::App& app, RunCommand& command, WorkText& text) {
  auto& options = command.options;
  const auto group = work_group;
  add_threads_option(app, command);
  add_level_option(app, command, "stays FUZZY");
  add_tolerance_option(app, command);
  add_budget_option(
      app, text,
      "stop after a time: 2s, 500ms, 1min, or seconds;\nwith --snapshot: the time between two (30s)");
  add_cells_option(app, command, "stop at about N cells");
  app.add_option("--steps", options.steps, "end after N steps as long as --budget says")
      ->check(is_number(1U, 1U << 30, "1 or more"))
      ->type_name("N")
      ->group(group);
  app.add_option("--angle", options.angle,
                 "stop where FUZZY cells are seen thinner than this\n"
                 "from --eye; 0.1 is three pixels of a picture of\n"
                 "1000 that is 30 degrees wide")
      ->check(acute_angle())
      ->type_name("DEGREES")
      ->group(group);
  app.add_option(
         "--order", text.order,
         "which cell is refined next: depth, priority (the\nlargest) or view (what looks largest from --eye)")
      ->check(is_one_of({"depth", "priority", "view"}))
      ->type_name("ORDER")
      ->group(group);
}

double parse_seconds(const std::string& text) {
  static const std::map<std::string, double> units{{"", 1}, {"s", 1}, {"ms", 1e-3}, {"min", 60}, {"h", 3600}};
  const auto split = text.find_first_not_of("0123456789.");
  const std::string number = text.substr(0, split),
                    unit = split == std::string::npos ? "" : text.substr(split);
  double value = 0;
  if (units.count(unit) == 0 || number.empty() || !CLI::detail::lexical_cast(number, value) || !(value > 0)) {
    throw Error("--budget: '" + text + "' is no time; write for example 2s, 500ms or 1min");
  }
  return value * units.at(unit);
}

void choose_work(const WorkText& text, Options& options) {
  set_kept(options, text.keep);
  options.parts_by_colour = text.parts == "colour" || text.parts == "color";
  if (text.order == "priority" || text.order == "view") options.order = Order::priority;
  if (!text.budget.empty()) options.budget = parse_seconds(text.budget);
}

}  // namespace bsp2::jobs
