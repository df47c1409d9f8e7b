#include "bsp2/viewing.hpp"

#include <bit>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/evaluation/run_options.hpp"
#include "bsp2/api/report/report_json.hpp"
#include "bsp2/formats.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "evaluation/patience.hpp"
#include "evaluation/told.hpp"
#include "outputs/outputs.hpp"
#include "viewer/file_watch.hpp"
#include "viewer/viewer.hpp"

namespace bsp2::api {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// What is shown, and to whom it is told.
struct Show {
  supersteps::RunOptions run;
  std::string name;                              ///< of the model
  std::optional<std::filesystem::path> watched;  ///< its file
  const ViewerOptions& viewer;
  const Options& options;
  Ranks::Implementation& ranks;
  std::vector<std::string> warnings{};  ///< of the files of an expression
  [[nodiscard]] bool is_stopped() const { return options.stop && options.stop(); }
};

/// What follows when there is nothing to compute.
enum class Next : char { wait = 'w', run = 'r', end = 'e' };

/// Looks, on the master, at files and pages.
class Lookout {
 public:
  Lookout(const Show& show, const Server& server, FileWatch* watch)
      : show_(show), server_(server), watch_(watch) {}
  /// From now on there is nothing to compute.
  void begin() { since_ = Clock::now(); }
  Next look() {
    if (show_.is_stopped()) return Next::end;
    if (watch_ != nullptr && watch_->has_changed()) return Next::run;
    if (show_.viewer.stay || server_.visits() == 0 || server_.pages() > 0) {
      since_ = Clock::now();
      return Next::wait;
    }
    constexpr auto reload = 3s;  // a page that is loaded again comes back
    return Clock::now() - since_ > reload ? Next::end : Next::wait;
  }

 private:
  const Show& show_;
  const Server& server_;
  FileWatch* watch_;
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

/// One run from the model to its surface. @param watch on the master, or null. Collective.
void show_once(const Show& show, Viewer& viewer, FileWatch* watch) {
  supersteps::Ranks& ranks = show.ranks.ranks;
  Told told(ranks, [&, begun = 0U](const Progress& now) mutable {
    if (std::exchange(begun, now.begun) != now.begun)
      viewer.superstep(now.superstep, now.phase);
    else
      viewer.progress(now.done, now.cells);
    if (show.options.progress) show.options.progress(now);
  });
  supersteps::RunOptions run = show.run;
  run.interrupted = [&] { return show.is_stopped() || (watch != nullptr && watch->has_changed()); };
  run.on_progress = [&](double done, std::uint64_t cells) { told.show(done, cells); };
  run.on_frame = [&](const supersteps::RunResult& now, unsigned) { viewer.show(now, ranks); };
  if (ranks.count() == 1)
    run.on_new_cells = [&](const std::shared_ptr<const geometry::CellBatch>& cells) { viewer.add(cells); };
  run.steer = [&](unsigned) { return viewer.steer(); };
  supersteps::RunResult result = show.ranks.engine(run, ranks);
  auto& warnings = result.report.warnings;
  warnings.insert(warnings.begin(), show.warnings.begin(), show.warnings.end());
  if (result.report.interrupted)
    viewer.fail("");
  else if (ranks.is_master())
    viewer.finish(result);
  if (show.viewer.evaluated) show.viewer.evaluated(figures_in(result.report));
}

/// Shows the model; a mistake in it ends the run alone, since it can be mended. Several ranks have lost each
/// other then, and it ends them. Collective.
void show_and_tell(const Show& show, Viewer& viewer, FileWatch* watch) {
  supersteps::Ranks& ranks = show.ranks.ranks;
  try {
    ranks.restart();
    viewer.begin(show.name);
    ranks.together([&] { show_once(show, viewer, watch); });
  } catch (const Error& error) {
    viewer.fail(error.what());
    if (ranks.count() > 1) {
      std::this_thread::sleep_for(500ms);  // pages hear of it
      throw;
    }
    if (show.viewer.failed) show.viewer.failed(error);
  }
}

void serve(const Show& show) {
  supersteps::Ranks& ranks = show.ranks.ranks;
  const Patience patience(ranks, show.options.timeout);
  std::optional<Viewer> viewer;
  std::optional<FileWatch> watch;
  std::optional<Lookout> lookout;
  ranks.together([&] {
    viewer.emplace(show.viewer, ranks.is_master());
    ranks.agree([&] {
      if (!ranks.is_master()) return;
      if (show.watched) watch.emplace(*show.watched);
      lookout.emplace(show, viewer->server(), watch ? &*watch : nullptr);
      if (show.viewer.serves) show.viewer.serves(viewer->server().link());
    });
  });
  for (;;) {
    if (watch) watch->begin();
    show_and_tell(show, *viewer, watch ? &*watch : nullptr);
    Next next = Next::end;
    if (lookout) lookout->begin();
    ranks.together([&] { next = wait_for_next(ranks, lookout ? &*lookout : nullptr); });
    if (next == Next::end) return;
  }
}

/// What the master says. Collective. @throws Error if it is a snapshot that cannot be read.
bool is_readable_snapshot(const std::filesystem::path& file, supersteps::Ranks& ranks) {
  bool is_one = false;
  ranks.together([&] {
    ranks.agree([&] {
      is_one = ranks.is_master() && is_snapshot(file);
      if (is_one) io::check_snapshot_is_readable(file);
    });
    is_one = told_by_master(is_one, ranks);
  });
  return is_one;
}

/// Without what the viewer decides itself.
Options of_viewer(Options options) {
  options.budget.reset();
  options.outputs = {};
  options.collect = Collect::automatic;
  return options;
}

/// What a run has to find to be shown, and soon: there is nothing to be seen before all regions are cut, and
/// a picture has them all.
supersteps::RunOptions shown(supersteps::RunOptions run, const ViewerOptions& viewer, int ranks) {
  constexpr unsigned regions_of_a_rank = 128;
  run.most_regions = regions_of_a_rank * std::bit_floor(static_cast<unsigned>(ranks));
  run.collect_cells = true;
  run.can_be_asked = run.finds_rounds = false;
  run.boundary = run.faces = run.keep_in;
  if (!viewer.eye.empty() && !run.angle)
    run.eye = viewer.eye;  // so it has as many numbers as the model has dimensions; steps have those of pages
  return run;
}

}  // namespace
}  // namespace bsp2::api

namespace bsp2 {

void view(const std::filesystem::path& file, const ViewerOptions& viewer, const Options& options,
          const Ranks& ranks) {
  guarded([&] {
    std::error_code none;
    if (std::filesystem::is_directory(file, none))
      throw Error("'" + file.string() + "' is a directory; a model or a snapshot is viewed");
    supersteps::RunOptions run =
        api::shown(run_options(api::of_viewer(options)), viewer, ranks.implementation()->ranks.count());
    if (api::is_readable_snapshot(file, ranks.implementation()->ranks)) {
      run.resume = file;
      run.steps = 0;  // nothing is computed, only shown as it is
    } else {
      run.model = file;
    }
    api::serve({std::move(run), file.filename().string(), file, viewer, options, *ranks.implementation()});
  });
}

void view(const Expression& expression, const ViewerOptions& viewer, const Options& options,
          const Ranks& ranks) {
  guarded([&] {
    std::vector<std::string> warnings;
    supersteps::RunOptions run = api::shown(run_options(expression, api::of_viewer(options), warnings),
                                            viewer, ranks.implementation()->ranks.count());
    const std::string name = run.model.filename().string();
    api::serve(
        {std::move(run), name, std::nullopt, viewer, options, *ranks.implementation(), std::move(warnings)});
  });
}

}  // namespace bsp2
