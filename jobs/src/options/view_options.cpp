#include "options/view_options.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "options/paths.hpp"
#include "options/picture_options.hpp"

namespace bsp2::jobs {
namespace {

constexpr auto view_footer =
    "Examples:\n"
    "  bsp2 view model.csg           open the link that is printed\n"
    "  bsp2 view model.scad --open   evaluated again whenever it is saved\n"
    "  bsp2 view out/snapshot.h5     what a snapshot holds\n"
    "\n"
    "The link works on this machine alone, and for those alone who have it. The\n"
    "command ends with the run and the last page; closing pages stops no run.";

}  // namespace

CLI::App* add_view_command(CLI::App& app, RunCommand& command, std::string& input, std::string& eye) {
  ViewCommand& viewer = command.viewer.emplace();
  CLI::App* view = app.add_subcommand("view", "Show a model in the browser while it is evaluated");
  add_input(*view, "MODEL|SNAPSHOT", input, model_or_snapshot_words);
  const auto group = "How it is shown";
  view->add_flag("--open", viewer.open, "open the page in the browser")->group(group);
  view->add_flag("--stay", viewer.stay, "go on serving when the last page is closed")->group(group);
  view->add_option("--port", viewer.port, "the port of the link (default: one that is free)")
      ->check(is_number(0U, 65535U, "0 .. 65535"))
      ->type_name("N")
      ->group(group);
  view->add_option("--listen", viewer.address,
                   "be reached at this address of the machine, 0.0.0.0 for\nall of them (default: 127.0.0.1, "
                   "by itself alone)")
      ->check(is_named())
      ->type_name("ADDRESS")
      ->group(group);
  view->add_option("--triangles", viewer.triangles,
                   "at most about so many are sent; what is smaller than\nthey can show is left out")
      ->check(is_number(std::uint64_t{1000}, std::uint64_t{1} << 32, "1000 or more"))
      ->type_name("N")
      ->capture_default_str()
      ->group(group);
  view->add_option("--eye", eye,
                   "where the page looks from at first; with --angle,\nwhat is seen from there decides what "
                   "is refined")
      ->type_name("X,Y,Z")
      ->group(group);
  view->add_flag("--quiet", command.quiet, "print the link and errors alone")->group(group);
  view->footer(view_footer);
  return view;
}

void describe_for_view(CLI::App& view) {
  view.get_option("--budget")
      ->description("the time between two pictures\n(default: a twentieth of a second, then ever longer)");
  view.get_option("--order")->description(
      "which cell is refined next: depth, priority (the\nlargest) or view (what looks largest from where "
      "the\npage looks; "
      "default: so at first, then depth)");
}

void choose_view_command(RunCommand& command, const std::string& input, const std::string& order,
                         const std::string& eye) {
  if (std::error_code none; !std::filesystem::exists(input, none))
    throw Error("cannot read '" + input + "': " + std::generic_category().message(ENOENT));
  choose_input(command, input);
  ViewCommand& viewer = *command.viewer;
  Options& options = command.options;
  if (!eye.empty()) viewer.eye = eye_of(eye);
  if (viewer.eye.size() == 1 || viewer.eye.size() > 3)
    throw Error("--eye: '" + eye +
                "' is no place to look from; write three numbers, for example --eye 30,-40,25");
  if (!order.empty()) viewer.order = options.order;
  viewer.follows_eye = order == "view";
  viewer.budget = options.budget;
  options.budget.reset();
}

}  // namespace bsp2::jobs
