#include "bsp2/api/evaluation/run_options.hpp"

#include <cmath>
#include <memory>

#include "bsp2/api/products/solver_mesh.hpp"
#include "expression/node.hpp"
#include "outputs/outputs.hpp"

namespace bsp2 {
namespace {

/// What the files of an expression had to say when they were translated.
void collect_warnings(const Expression::Node& root, std::vector<std::string>& warnings) {
  std::vector<const Expression::Node*> left{&root};
  while (!left.empty()) {
    const Expression::Node* node = left.back();
    left.pop_back();
    warnings.insert(warnings.end(), node->warnings.begin(), node->warnings.end());
    for (auto at = node->operands.rbegin(); at != node->operands.rend(); ++at) left.push_back(at->get());
  }
}

supersteps::Collect collect_of(Collect collect) {
  switch (collect) {
    case Collect::master:
      return supersteps::Collect::master;
    case Collect::tree:
      return supersteps::Collect::tree;
    case Collect::file:
      return supersteps::Collect::file;
    case Collect::automatic:
      break;
  }
  return supersteps::Collect::automatic;
}

}  // namespace

void check_positive(const char* name, const std::optional<double>& number) {
  if (number && !(*number > 0 && std::isfinite(*number)))
    throw Error(std::string(name) + " is " + Value(*number).text() + "; it takes a number above 0");
}

void check_outputs(const Options& options) {
  const Outputs& files = options.outputs;
  const bool shows_cells = files.cells || files.picture || files.of_steps() || files.solver_mesh;
  if (options.measures_only && (shows_cells || !files.surfaces.empty() || files.drawing))
    throw Error("measures_only finds no cells, which outputs need");
  if (options.surface_only && shows_cells) throw Error("surface_only finds no cells, which outputs need");
}

supersteps::RunOptions run_options(const Options& options) {
  check_outputs(options);
  api::check_size_field(options.size_field);
  check_positive("size", options.size);
  if (!options.size_field.empty() && (options.angle || options.snapshot))
    throw Error("size_field goes neither with angle nor with snapshot");
  check_positive("tolerance", options.tolerance);
  check_positive("angle", options.angle);
  check_positive("budget", options.budget);
  if (options.timeout && !(*options.timeout >= 0 && std::isfinite(*options.timeout)))
    throw Error("timeout is " + Value(*options.timeout).text() + "; it takes a number of seconds, 0: never");
  for (const double x : options.eye)
    if (!std::isfinite(x)) throw Error("eye has a number that is not finite");
  if (!(options.coincidence >= 0 && options.coincidence <= 1e-3))
    throw Error("coincidence is " + Value(options.coincidence).text() +
                "; it takes a number from 0 to 0.001");
  if (!options.keep_in && !options.keep_fuzzy && !options.keep_out)
    throw Error("no cells are kept at all; measures_only is for that");
  constexpr unsigned most_regions = 1U << 20, most_level = 65535, most_threads = 4096;
  if (options.threads > most_threads)
    throw Error("threads is " + std::to_string(options.threads) + "; it takes 0 to " +
                std::to_string(most_threads));
  if (options.regions && (*options.regions < 1 || *options.regions > most_regions))
    throw Error("regions is " + std::to_string(*options.regions) + "; it takes 1 to " +
                std::to_string(most_regions));
  if (options.level && *options.level > most_level)
    throw Error("level is " + std::to_string(*options.level) + "; it takes 0 to " +
                std::to_string(most_level));
  if (options.cells && *options.cells == 0) throw Error("cells is 0; it takes a number above 0");
  if (options.angle && options.eye.empty()) throw Error("an angle needs an eye from which it is seen");
  supersteps::RunOptions run;
  run.threads = options.threads;
  run.regions = options.regions;
  run.coincidence = options.coincidence;
  run.curved = options.curved;
  run.parts_by_colour = options.parts_by_colour;
  run.order = options.order;
  run.eye = options.eye;
  run.level = options.level;
  run.tolerance = options.tolerance;
  run.tolerance_shares = api::tolerance_shares(options.size_field, options.size);
  run.angle = options.angle;
  run.budget_seconds = options.budget;
  if (options.budget && !options.outputs.of_steps()) run.steps = 1;
  if (options.steps) run.steps = options.steps;
  run.cells = options.cells;
  run.strict = options.strict;
  run.keep_in = options.keep_in;
  run.keep_fuzzy = options.keep_fuzzy;
  run.keep_out = options.keep_out;
  run.collect_cells = !options.measures_only;
  run.can_be_asked = !options.measures_only;
  run.boundary = options.surface || options.surface_only || options.faces;
  run.faces = options.faces;
  run.surface_only = options.surface_only;
  // Files that are written later may want it, and where cells are gone, or stay on the ranks, it is not found
  // then.
  run.closes_parts = !options.outputs_only &&
                     (options.surface_only || options.measures_only || options.collect == Collect::file);
  run.contacts = options.contacts;
  run.snapshot = options.snapshot;
  run.interrupted = options.stop;
  run.collect = collect_of(options.collect);
  api::ask_for(options.outputs, options.outputs_only, run);
  return run;
}

supersteps::RunOptions run_options(const Expression& expression, const Options& options,
                                   std::vector<std::string>& warnings) {
  supersteps::RunOptions run = run_options(options);
  const Expression::Node& root = *expression.root();
  run.model = root.is_text() ? root.source : "model";
  // What was loaded is read as it stands: places in messages are those of the file.
  run.text = std::make_shared<const std::string>(root.is_text() ? root.text : expression.to_text());
  run.read = root.read;
  collect_warnings(root, warnings);
  if (options.strict && !warnings.empty())
    throw Error(warnings.front() + "; strict turns warnings into errors");
  return run;
}

}  // namespace bsp2
