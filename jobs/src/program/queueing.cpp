#include "program/queueing.hpp"

#include <ostream>
#include <system_error>
#include <utility>

#include "answers/job_status.hpp"
#include "bsp2/bsp2.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "program/signals.hpp"
#include "tables/node_tables.hpp"

namespace bsp2::jobs {
namespace {

/// What fixes the cells, as the library takes it.
Options options_of(const supersteps::RunOptions& run) {
  Options options;
  options.threads = run.threads;
  options.regions = run.regions;
  options.level = run.level;
  options.tolerance = run.tolerance;
  options.curved = run.curved;
  options.coincidence = run.coincidence;
  options.parts_by_colour = run.parts_by_colour;
  options.keep_in = run.keep_in;
  options.keep_fuzzy = run.keep_fuzzy;
  options.keep_out = run.keep_out;
  options.strict = run.strict;
  return options;
}

/// @return the exit code.
int work(const QueueCommand& command, const supersteps::RunOptions& run, std::ostream& out) {
  const JobQueue queue(command.folder);
  const SignalWatch watch;
  WorkOptions options;
  options.threads = run.threads;
  if (run.budget_seconds) options.budget = *run.budget_seconds;
  options.cells = run.cells;
  options.job = command.job;
  options.until_empty = command.until_empty;
  options.lease = command.lease_seconds;
  options.stop = SignalWatch::interrupted;
  options.done = [&](const Job& job, bool is_new) { print_outcome(out, job, is_new); };
  return queue.work(options) ? interrupted_code : 0;
}

}  // namespace

void tables_command(const RunCommand& command, std::ostream& out) {
  std::vector<std::optional<unsigned>> levels(command.levels.begin(), command.levels.end());
  if (!levels.empty() || command.brief) levels.emplace_back();
  const auto tables = measure_tables(load(command.options.model), command.tables, levels, !command.brief,
                                     options_of(command.options));
  out << command.options.model.string() << "\n\n";
  print_tables(out, tables, command.brief);
}

int queue_command(const RunCommand& command, std::ostream& speech) {
  std::ostream silence(nullptr);
  std::ostream& out = command.quiet ? silence : speech;
  const QueueCommand& queue = *command.queue;
  switch (queue.action) {
    case QueueCommand::Action::split: {
      const auto made = JobQueue::split(load(command.options.model), queue.folder, queue.job_seconds,
                                        options_of(command.options));
      out << queue.folder.string() << counted(made.size(), ": # job[s]") << '\n';
      return 0;
    }
    case QueueCommand::Action::run:
      return work(queue, command.options, out);
    case QueueCommand::Action::status:
      print_status(out, JobQueue(queue.folder), queue.all);
      return 0;
    case QueueCommand::Action::merge:
      break;  // a run that resumes what was joined
  }
  return 0;
}

JoinedSnapshot::JoinedSnapshot(const RunCommand& command, supersteps::Ranks& ranks) {
  path_ = command.options.snapshot.value_or(command.queue->folder / ".joined.h5");
  is_mine_ = !command.options.snapshot && ranks.is_master();
  if (ranks.is_master()) JobQueue(command.queue->folder).join(path_, command.queue->partial);
  ranks.sync();
}

JoinedSnapshot::~JoinedSnapshot() {
  std::error_code ignored;
  if (is_mine_) std::filesystem::remove(path_, ignored);
}

}  // namespace bsp2::jobs
