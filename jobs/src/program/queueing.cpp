#include "program/queueing.hpp"

#include <ostream>
#include <system_error>
#include <utility>

#include "answers/job_status.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "program/signals.hpp"
#include "tables/node_tables.hpp"

namespace bsp2::jobs {
namespace {

/// @return the exit code.
int work(const QueueCommand& command, const Options& of_run, std::ostream& out) {
  const JobQueue queue(command.folder);
  const SignalWatch watch;
  WorkOptions options;
  options.threads = of_run.threads;
  if (of_run.budget) options.budget = *of_run.budget;
  options.cells = of_run.cells;
  options.job = command.job;
  options.until_empty = command.until_empty;
  options.lease = command.lease_seconds;
  options.stop = SignalWatch::interrupted;
  options.done = [&](const Job& job, bool is_new) { print_outcome(out, job, is_new); };
  return queue.work(options) ? interrupted_code : 0;
}

}  // namespace

void tables_command(const RunCommand& command, std::ostream& out) {
  if (command.of_surface) {
    const auto tables = measure_surface(load(command.model), command.tables, command.options);
    out << command.model.string() << "\n\n";
    print_surface_table(out, tables);
    return;
  }
  std::vector<std::optional<unsigned>> levels(command.levels.begin(), command.levels.end());
  if (!levels.empty() || command.brief) levels.emplace_back();
  const auto tables =
      measure_tables(load(command.model), command.tables, levels, !command.brief, command.options);
  out << command.model.string() << "\n\n";
  print_tables(out, tables, command.brief);
}

int queue_command(const RunCommand& command, std::ostream& speech) {
  std::ostream silence(nullptr);
  std::ostream& out = command.quiet ? silence : speech;
  const QueueCommand& queue = *command.queue;
  switch (queue.action) {
    case QueueCommand::Action::split: {
      const auto made =
          JobQueue::split(load(command.model), queue.folder, queue.job_seconds, command.options);
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

JoinedSnapshot::JoinedSnapshot(const RunCommand& command, const Ranks& ranks) {
  path_ = command.options.snapshot.value_or(command.queue->folder / ".joined.h5");
  is_mine_ = !command.options.snapshot && ranks.is_master();
  const auto join = [&] {
    if (ranks.is_master()) JobQueue(command.queue->folder).join(path_, command.queue->partial);
  };
  ranks.together(join, command.options.timeout);
}

JoinedSnapshot::~JoinedSnapshot() {
  std::error_code ignored;
  if (is_mine_) std::filesystem::remove(path_, ignored);
}

}  // namespace bsp2::jobs
