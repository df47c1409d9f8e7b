#include "program/viewing.hpp"

#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <chrono>
#include <thread>

#include "answers/progress_bar.hpp"
#include "answers/summary.hpp"
#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/evaluation/run_options.hpp"
#include "bsp2/api/report/report_json.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "program/signals.hpp"
#include "viewer/file_watch.hpp"
#include "viewer/viewer.hpp"

extern char** environ;

namespace bsp2::jobs {
namespace {

using Clock = std::chrono::steady_clock;
using Run = Ranks::Implementation::Engine;
using namespace std::chrono_literals;

void open_in_browser(const std::string& link, spdlog::logger& log) {
  std::string program = "xdg-open", argument = link;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  if (::posix_spawnp(&child, "xdg-open", nullptr, nullptr, arguments, environ) != 0) {
    log.warn("--open: there is no xdg-open here; open the link by hand");
    return;
  }
  std::thread([child] { ::waitpid(child, nullptr, 0); }).detach();
}

/// What follows when there is nothing to compute.
enum class Next : char { wait = 'w', run = 'r', end = 'e' };

/// Looks, on the master, at files and pages.
class Lookout {
 public:
  Lookout(const ViewCommand& command, const Server& server, FileWatch& watch)
      : command_(command), server_(server), watch_(watch) {}
  /// From now on there is nothing to compute.
  void begin() { since_ = Clock::now(); }
  Next look() {
    if (SignalWatch::interrupted()) return Next::end;
    if (watch_.has_changed()) return Next::run;
    if (command_.stay || server_.visits() == 0 || server_.pages() > 0) {
      since_ = Clock::now();
      return Next::wait;
    }
    constexpr auto reload = 3s;  // a page that is loaded again comes back
    return Clock::now() - since_ > reload ? Next::end : Next::wait;
  }

 private:
  const ViewCommand& command_;
  const Server& server_;
  FileWatch& watch_;
  Clock::time_point since_ = Clock::now();
};

/// Waits until something is to be done; the ranks hear it from the master. Collective.
Next wait_for_next(supersteps::Ranks& ranks, Lookout* lookout) {
  for (;;) {
    Next next = lookout != nullptr ? lookout->look() : Next::wait;
    if (ranks.count() > 1) {
      if (ranks.is_master())
        for (int rank = 1; rank < ranks.count(); ++rank)
          ranks.send(rank, std::string(1, static_cast<char>(next)));
      ranks.sync();
      for (const auto& message : ranks.received()) next = static_cast<Next>(message.bytes.front());
    }
    if (next != Next::wait) return next;
    std::this_thread::sleep_for(50ms);
  }
}

/// What one run needs besides the viewer.
struct Session {
  const RunCommand& command;
  std::ostream& out;
  supersteps::Ranks& ranks;
  const Run& run;
  spdlog::logger& log;
  Viewer& viewer;
  FileWatch* watch;  ///< on the master
};

/// One run from the model to its surface. Collective. @return its exit code.
int view_once(const Session& session) {
  const auto& [command, out, ranks, run, log, viewer, watch] = session;
  const bool speaks = ranks.is_master() && !command.quiet;
  ProgressBar bar(speaks ? stderr : nullptr);
  supersteps::RunOptions options = run_options(command.options);
  options.model = command.model;
  options.resume = command.resume;
  options.can_be_asked = false;
  options.interrupted = [watch = watch] {
    return SignalWatch::interrupted() || (watch != nullptr && watch->has_changed());
  };
  options.on_progress = [&viewer = viewer, &bar](double done, std::uint64_t cells) {
    viewer.progress(done, cells);
    bar.show(done, cells);
  };
  options.on_frame = [&viewer = viewer, &ranks = ranks](const supersteps::RunResult& now, unsigned) {
    viewer.show(now, ranks);
  };
  if (ranks.count() == 1)
    options.on_new_cells = [&viewer = viewer](const std::shared_ptr<const geometry::CellBatch>& cells) {
      viewer.add(cells);
    };
  options.steer = [&viewer = viewer](unsigned) { return viewer.steer(); };
  ranks.on_superstep = [&viewer = viewer, &bar](const std::string& name, unsigned) {
    viewer.superstep(name);
    bar.begin(name);
  };
  const supersteps::RunResult result = run(options, ranks);
  bar.clear();
  if (result.report.interrupted) {
    viewer.fail("");
    return interrupted_code;
  }
  if (!ranks.is_master()) return 0;
  viewer.finish(result);
  for (const std::string& warning : result.report.warnings) log.warn("warning: {}", warning);
  if (speaks)
    for (const std::string& note : result.report.notes) log.info("note: {}", note);
  for (const auto& failed : result.report.failed) log.error("{}", failed.text);
  if (speaks) print_summary(out, api::figures_in(result.report), false);
  if (speaks) out << std::endl;
  return result.report.failed.empty() ? 0 : 1;
}

/// The same, and a mistake in the model ends the run alone: it can be mended. Several ranks have lost each
/// other then, and it ends them. Collective.
int view_and_tell(const Session& session) {
  const auto& [command, out, ranks, run, log, viewer, watch] = session;
  int code = 0;
  const auto& model = command.resume.value_or(command.model);
  try {
    ranks.restart();
    viewer.begin(model.filename().string());
    ranks.together([&] { code = view_once(session); });
  } catch (const Error& error) {
    viewer.fail(error.what());
    if (ranks.count() > 1) {
      std::this_thread::sleep_for(500ms);  // pages hear of it
      throw;
    }
    log.error("{}", error.what());
    code = 2;
  }
  ranks.on_superstep = nullptr;
  return code;
}

}  // namespace

int view_command(const RunCommand& command, std::ostream& out, const Ranks& all, spdlog::logger& log) {
  auto& [ranks, run] = *all.implementation();
  if (command.resume) io::check_snapshot_is_readable(*command.resume);
  std::optional<Viewer> viewer;
  ranks.together([&] { viewer.emplace(*command.viewer, ranks.is_master()); });
  const SignalWatch watched("", false);
  SignalWatch::interrupted();  // from here on signals are remembered
  std::optional<FileWatch> watch;
  std::optional<Lookout> lookout;
  if (ranks.is_master()) {
    watch.emplace(command.resume.value_or(command.model));
    lookout.emplace(*command.viewer, viewer->server(), *watch);
    out << viewer->server().link() << std::endl;
    if (command.viewer->open) open_in_browser(viewer->server().link(), log);
  }
  const Session session{command, out, ranks, run, log, *viewer, watch ? &*watch : nullptr};
  for (;;) {
    if (watch) watch->begin();
    const int code = view_and_tell(session);
    Next next = Next::end;
    if (lookout) lookout->begin();
    ranks.together([&] { next = wait_for_next(ranks, lookout ? &*lookout : nullptr); });
    if (next == Next::end) return code;
  }
}

}  // namespace bsp2::jobs
