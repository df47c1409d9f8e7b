#include "options/queue_options.hpp"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>

#include "options/checks.hpp"

namespace bsp2::jobs {
namespace {

constexpr auto footer =
    "Example, on any number of machines that see the folder:\n"
    "  bsp2 jobs split tower.csg queue       once\n"
    "  bsp2 jobs run queue                   everywhere, as often as you like\n"
    "  bsp2 jobs merge queue -o out          once, when all is done\n"
    "Exit code of run: 75 if a signal ended it early; what it found is kept.";

}  // namespace

QueueCommands add_queue_commands(CLI::App& app, RunCommand& command) {
  command.queue.emplace();
  QueueCommand& queue = *command.queue;
  QueueCommands commands{};
  commands.jobs = app.add_subcommand("jobs", "Evaluate a model by a queue of independent jobs");
  commands.jobs->require_subcommand(1);
  commands.jobs->footer(footer);
  commands.split = commands.jobs->add_subcommand("split", "Make a queue: a job a region");
  commands.split->add_option("MODEL", command.model, "the model: a .csg or .scad file")
      ->required()
      ->check(is_named())
      ->type_name("");
  commands.run = commands.jobs->add_subcommand("run", "Take jobs and evaluate them until none is left");
  commands.merge = commands.jobs->add_subcommand("merge", "Put the results together as a run would");
  commands.status = commands.jobs->add_subcommand("status", "Tell how far the jobs are");
  for (CLI::App* each : {commands.split, commands.run, commands.merge, commands.status})
    each->add_option("QUEUE", queue.folder, "the folder of the queue")
        ->required()
        ->check(is_named())
        ->type_name("");
  commands.split
      ->add_option("--level", command.options.level, "stop after N cuts in a row; the rest stays FUZZY")
      ->check(is_number(0U, 65535U, "0 .. 65535"))
      ->type_name("N");
  commands.run->add_option("--job", queue.job, "only this job and what it is divided into")
      ->check(is_number(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max(), "0 or more"))
      ->type_name("I");
  commands.run->add_flag("--until-empty", queue.until_empty, "with --job: then all others (without: always)");
  commands.run
      ->add_option("--lease", queue.lease_seconds,
                   "a job whose worker gave no sign\nfor so long is taken again")
      ->check(is_number(1.0, 1e6, "1 .. 1000000"))
      ->type_name("SECONDS")
      ->capture_default_str();
  commands.split
      ->add_option("--job-seconds", queue.job_seconds,
                   "regions share a job until it is about so much work;\n0: a job a region")
      ->check(is_number(0.0, 1e6, "0 .. 1000000"))
      ->type_name("SECONDS")
      ->capture_default_str();
  commands.split->add_flag("--quiet", command.quiet, "do not tell how many jobs there are");
  commands.run->add_flag("--quiet", command.quiet, "print no line for each job");
  commands.status->add_flag("--all", queue.all, "a line for each job, not only for those at work");
  commands.merge->add_flag("--partial", queue.partial, "what is missing stays FUZZY");
  return commands;
}

void choose_queue_command(const QueueCommands& commands, RunCommand& command) {
  if (!commands.jobs->parsed()) return command.queue.reset();
  QueueCommand& queue = *command.queue;
  queue.action = commands.split->parsed()   ? QueueCommand::Action::split
                 : commands.run->parsed()   ? QueueCommand::Action::run
                 : commands.merge->parsed() ? QueueCommand::Action::merge
                                            : QueueCommand::Action::status;
  if (queue.action == QueueCommand::Action::run) command.options.budget = 60;
  if (queue.partial) command.options.steps = 0;  // nothing more is computed
}

}  // namespace bsp2::jobs
