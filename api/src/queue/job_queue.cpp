#include <cmath>
#include <utility>

#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/evaluation/run_options.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "queue/claim.hpp"
#include "queue/queue.hpp"

namespace bsp2 {

class JobQueue::Implementation {
 public:
  explicit Implementation(std::filesystem::path folder) : queue(std::move(folder)) {}
  api::Queue queue;
};

JobQueue JobQueue::split(const Expression& expression, const std::filesystem::path& folder,
                         double job_seconds, const Options& options) {
  return guarded([&] {
    if (!(job_seconds >= 0 && std::isfinite(job_seconds)))
      throw Error("job_seconds is " + Value(job_seconds).text() + "; it takes 0 or more");
    if (!options.size_field.empty()) throw Error("jobs know no size_field");
    std::vector<std::string> ignored;  // told when the results are put together
    api::Queue::split(run_options(expression, options, ignored), folder, job_seconds);
    return JobQueue(folder);
  });
}

JobQueue::JobQueue(std::filesystem::path folder)
    : implementation_(guarded([&] { return std::make_shared<Implementation>(std::move(folder)); })) {}

const std::filesystem::path& JobQueue::folder() const { return implementation_->queue.folder(); }

std::size_t JobQueue::size() const { return implementation_->queue.size(); }

std::vector<Job> JobQueue::jobs() const {
  return guarded([&] {
    api::Queue& queue = implementation_->queue;
    std::vector<Job> jobs;
    for (api::QueuedJob& queued : queue.jobs()) {
      Job& job = jobs.emplace_back(std::move(queued.job));
      if (job.state != Job::State::running) continue;
      const auto claim = api::look_at_claim(queue.claim(job.name), WorkOptions().lease);
      if (!claim) continue;  // it ended just now
      job.owner = claim->owner;
      if (claim->is_lost) job.state = Job::State::lost;
    }
    return jobs;
  });
}

bool JobQueue::work(const WorkOptions& options) const {
  return guarded([&] {
    check_positive("budget", options.budget);
    if (!(options.lease >= 1 && options.lease <= 1e6))
      throw Error("lease is " + Value(options.lease).text() + "; it takes 1 to 1000000 seconds");
    if (options.cells && *options.cells == 0) throw Error("cells is 0; it takes a number above 0");
    return api::work_on(implementation_->queue, options);
  });
}

void JobQueue::join(const std::filesystem::path& snapshot, bool partial) const {
  guarded([&] {
    io::check_snapshot_path(snapshot);
    api::join_jobs(implementation_->queue, partial, snapshot);
  });
}

}  // namespace bsp2
