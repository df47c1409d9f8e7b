#include "options/paths.hpp"

namespace bsp2::jobs {
namespace {

void refuse_solid_options(const Options& options) {
  if (options.curved || options.parts_by_colour || options.tolerance ||
      options.coincidence != Options().coincidence)
    throw Error("--curved, --parts, --coincidence and --tolerance are those of the snapshot: leave them out");
}

}  // namespace

void choose_input(RunCommand& command, const std::filesystem::path& input) {
  if (is_snapshot(input)) {
    refuse_solid_options(command.options);
    command.resume = input;
    command.options.steps = 0;
  } else {
    command.model = input;
  }
}

}  // namespace bsp2::jobs
