#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <map>
#include <memory>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "queue/claim.hpp"
#include "queue/queue.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

/// A result gets its name by a link, which fails if the job has one: a file that is there never changes.
/// @return false if it had one.
bool commit(const fs::path& unnamed, const fs::path& name) {
  int error = ::link(unnamed.c_str(), name.c_str()) == 0 ? 0 : errno;
  if (error != 0 && error != EEXIST)  // file systems without hard links
    error = ::renameat2(AT_FDCWD, unnamed.c_str(), AT_FDCWD, name.c_str(), RENAME_NOREPLACE) == 0 ? 0 : errno;
  ::unlink(unnamed.c_str());
  if (error != 0 && error != EEXIST)
    throw Error("cannot write '" + name.string() + "': " + std::generic_category().message(error));
  return error == 0;
}

bool is_of(const std::string& name, std::uint32_t root) {
  const std::string text = std::to_string(root);
  return name == text || name.starts_with(text + ".");
}

/// The work of one process on a queue.
class QueueWorker {
 public:
  QueueWorker(Queue& queue, const WorkOptions& options) : queue_(queue), options_(options) {
    how_.threads = options.threads;
    how_.budget_seconds = options.budget;
    how_.cells = options.cells;
    how_.interrupted = options.stop;
  }

  bool run() {
    while (!is_stopped()) {
      if (take_one()) continue;
      if (!has_to_watch()) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    return is_stopped();
  }

 private:
  Queue& queue_;
  const WorkOptions& options_;
  supersteps::RunOptions how_;
  std::unique_ptr<supersteps::PortionEvaluator> evaluator_;  // made when there is something to evaluate
  std::map<std::string, timespec> seen_;  // claims of others, and when they were touched at first sight

  [[nodiscard]] bool is_stopped() const { return options_.stop && options_.stop(); }
  [[nodiscard]] bool is_first(const Job& job) const { return options_.job && is_of(job.name, *options_.job); }

  /// Jobs that nobody has, in the order in which they are taken: what was divided is known to be big, then by
  /// the estimate.
  std::vector<QueuedJob> open_jobs() {
    std::vector<QueuedJob> open;
    for (QueuedJob& queued : queue_.jobs()) {
      if (!queued.is_open()) continue;
      if (options_.job && !options_.until_empty && !is_first(queued.job)) continue;
      open.push_back(std::move(queued));
    }
    std::stable_sort(open.begin(), open.end(), [this](const QueuedJob& a, const QueuedJob& b) {
      const auto rank = [this](const QueuedJob& queued) {
        return std::tuple(!is_first(queued.job), queued.parent ? 0 : 1, -queued.job.work);
      };
      return rank(a) < rank(b);
    });
    return open;
  }

  /// @return whether a job was evaluated.
  bool take_one() {
    for (const QueuedJob& queued : open_jobs()) {
      const std::string& name = queued.job.name;
      const fs::path file = queue_.claim(name);
      if (queued.job.state == Job::State::running) {
        const auto state = look_at_claim(file, options_.lease);
        if (state && !state->is_lost) continue;
        if (state) drop_lost_claim(file);
      }
      const auto claim = Claim::take(file, options_.lease);
      if (!claim || fs::exists(queue_.result(name))) continue;
      evaluate(queued);
      return true;
    }
    return false;
  }

  void evaluate(const QueuedJob& queued) {
    if (!evaluator_) evaluator_ = std::make_unique<supersteps::PortionEvaluator>(queue_.plan());
    Job job = queued.job;
    job.owner = this_process();
    const fs::path unnamed = queue_.folder() / "done" / ("." + job.name + "." + this_worker());
    const auto found = evaluator_->evaluate(queued.portion, how_, unnamed);
    const bool is_new = commit(unnamed, queue_.result(job.name));
    tell(job, found);
    if (options_.done) options_.done(job, is_new);
  }

  /// Whether somebody's claim has neither been touched nor ended since it was first seen here: it may be
  /// lost.
  bool has_to_watch() {
    bool watches = false;
    std::map<std::string, timespec> now;
    for (const QueuedJob& queued : open_jobs()) {
      const std::string& name = queued.job.name;
      const auto state = look_at_claim(queue_.claim(name), options_.lease);
      if (!state) return true;  // just ended: look again
      const auto before = seen_.find(name);
      const bool is_alive = before != seen_.end() && (before->second.tv_sec != state->touched.tv_sec ||
                                                      before->second.tv_nsec != state->touched.tv_nsec);
      watches = watches || !is_alive;
      now[name] = before != seen_.end() ? before->second : state->touched;
    }
    seen_ = std::move(now);
    return watches;
  }
};

}  // namespace

bool work_on(Queue& queue, const WorkOptions& options) {
  if (options.job && *options.job >= queue.size())
    throw Error("job " + std::to_string(*options.job) + ": the queue has " +
                counted(queue.size(), "# job[s], the first being 0"));
  return QueueWorker(queue, options).run();
}

}  // namespace bsp2::api
