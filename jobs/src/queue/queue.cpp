#include "queue/queue.hpp"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <optional>
#include <ostream>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "queue/claim.hpp"

namespace bsp2::jobs {
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

std::string line_of(std::size_t number, double work, const std::vector<std::uint32_t>& regions) {
  std::string line = fmt::format("{} {}", number, work);
  for (const std::uint32_t region : regions) line += ' ' + std::to_string(region);
  return line + '\n';
}

/// Seconds that a unit of estimated work takes one thread, by a look at some regions; nothing if already one
/// of them takes long. @param unnamed a file that may be written, and is removed.
std::optional<double> seconds_a_unit(const fs::path& plan, const std::vector<supersteps::RegionWork>& regions,
                                     const fs::path& unnamed, const std::function<bool()>& interrupted) {
  constexpr double enough = 0.1, most = 0.5;
  supersteps::PortionEvaluator evaluator(plan);
  supersteps::RunOptions how;
  how.threads = 1;
  how.budget_seconds = most;
  how.interrupted = interrupted;
  std::optional<double> known;
  for (std::size_t count = 1; count <= regions.size(); count *= 4) {
    supersteps::Portion sample{plan, {}};
    double work = 0;
    for (std::size_t i = 0; i < count; ++i) {  // all over the list: it is in the order of work
      const auto& region = regions[(2 * i + 1) * regions.size() / (2 * count)];
      sample.regions.push_back(region.region);
      work += region.work;
    }
    const auto state = evaluator.evaluate(sample, how, unnamed);
    if (!state.is_finished) break;
    if (state.seconds > 0) known = state.seconds / work;
    if (state.seconds >= enough) break;
  }
  std::error_code ignored;
  fs::remove(unnamed, ignored);
  return known;
}

/// A part of a list of regions, the one with most work first, in which something is undecided.
std::vector<supersteps::RegionWork> undecided(const std::vector<supersteps::RegionWork>& regions) {
  std::vector<supersteps::RegionWork> some;
  std::copy_if(regions.begin(), regions.end(), std::back_inserter(some),
               [](const auto& region) { return region.work > 0; });
  return some;
}

bool is_of(const std::string& name, std::uint32_t root) {
  const std::string text = std::to_string(root);
  return name == text || name.starts_with(text + ".");
}

}  // namespace

void Queue::split(const supersteps::RunOptions& options, const fs::path& folder, double job_seconds) {
  std::error_code error;
  if (fs::exists(folder, error) && (!fs::is_directory(folder, error) || !fs::is_empty(folder, error)))
    throw Error("'" + folder.string() +
                "' exists and is not empty; name a new folder for the queue, or remove it");
  io::check_folder(folder);
  const auto regions = supersteps::make_plan(
      options, folder / "plan.h5");  // first: of a model that is refused no folder is left
  for (const char* name : {"claims", "done"}) io::make_folder(folder / name);
  const double all = std::accumulate(regions.begin(), regions.end(), 0.0,
                                     [](double sum, const auto& region) { return sum + region.work; });
  std::string text;
  std::vector<std::uint32_t> rest;  // regions in which nothing is undecided are no job each
  std::size_t number = 0;
  std::vector<std::uint32_t>
      together;  // small regions, the work of which is not worth a claim and a file each
  double work = 0, least = 0;
  if (const auto some = undecided(regions); job_seconds > 0 && some.size() > 1)
    if (const auto seconds =
            seconds_a_unit(folder / "plan.h5", some, folder / ".sample.h5", options.interrupted))
      least = job_seconds / *seconds;
  const auto add_job = [&] {
    text += line_of(number++, work / all, together);
    together.clear();
    work = 0;
  };
  for (const auto& region : regions) {
    if (region.work <= 0) {
      rest.push_back(region.region);
      continue;
    }
    together.push_back(region.region);
    work += region.work;
    if (work >= least) add_job();
  }
  if (!together.empty()) add_job();
  if (!rest.empty()) text += line_of(number, all > 0 ? 0 : 1, rest);
  io::write_file(folder / "jobs.txt", text);
}

Queue::Queue(fs::path folder) : folder_(std::move(folder)) {
  std::ifstream file(folder_ / "jobs.txt");
  if (!file)
    throw Error("'" + folder_.string() + "' is no queue of jobs; make one with 'bsp2 jobs split MODEL " +
                folder_.string() + "'");
  for (std::string line; std::getline(file, line);) {
    std::istringstream in(line);
    Job job;
    in >> job.name >> job.work;
    job.portion.parent = plan();
    for (std::uint32_t region; in >> region;) job.portion.regions.push_back(region);
    if (job.name != std::to_string(planned_.size()) || job.portion.regions.empty())
      throw Error("'" + (folder_ / "jobs.txt").string() + "' is damaged; split the model anew");
    planned_.push_back(std::move(job));
  }
}

void Queue::add(std::vector<Job>& all, Job job) {
  const fs::path file = result(job.name);
  auto known = results_.find(job.name);
  if (known == results_.end() && fs::exists(file))
    known = results_.emplace(job.name, supersteps::read_portion(file)).first;
  if (known == results_.end()) {
    job.state = fs::exists(claim(job.name)) ? Job::State::claimed : Job::State::waiting;
    all.push_back(std::move(job));
    return;
  }
  job.result = known->second;
  job.state = job.result.is_finished ? Job::State::finished : Job::State::divided;
  const int halves = job.result.halves();
  Job half;
  half.parent = all.size();
  half.work = job.work / 2;
  half.portion.parent = file;
  const std::string name = job.name;
  all.push_back(std::move(job));
  for (half.portion.half = 0; half.portion.half < halves; ++half.portion.half) {
    half.name = name + "." + std::to_string(half.portion.half);
    add(all, half);
  }
}

std::vector<Job> Queue::jobs() {
  std::vector<Job> all;
  for (const Job& job : planned_) add(all, job);
  return all;
}

namespace {

/// The work of one process on a queue.
class QueueWorker {
 public:
  QueueWorker(Queue& queue, const QueueCommand& command, const supersteps::RunOptions& options,
              std::ostream& out)
      : queue_(queue), command_(command), options_(options), out_(out) {}

  bool run() {
    while (!is_interrupted()) {
      if (take_one()) continue;
      if (!has_to_watch()) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    return is_interrupted();
  }

 private:
  Queue& queue_;
  const QueueCommand& command_;
  const supersteps::RunOptions& options_;
  std::ostream& out_;
  std::unique_ptr<supersteps::PortionEvaluator> evaluator_;  // made when there is something to evaluate
  std::map<std::string, timespec> seen_;  // claims of others, and when they were touched at first sight

  [[nodiscard]] bool is_interrupted() const { return options_.interrupted && options_.interrupted(); }
  [[nodiscard]] bool is_first(const Job& job) const { return command_.job && is_of(job.name, *command_.job); }

  /// Jobs that nobody has, in the order in which they are taken: what was divided is known to be big, then by
  /// the estimate.
  std::vector<Job> open_jobs() {
    std::vector<Job> open;
    for (Job& job : queue_.jobs()) {
      if (job.state != Job::State::waiting && job.state != Job::State::claimed) continue;
      if (command_.job && !command_.until_empty && !is_first(job)) continue;
      open.push_back(std::move(job));
    }
    std::stable_sort(open.begin(), open.end(), [this](const Job& a, const Job& b) {
      const auto rank = [this](const Job& job) {
        return std::tuple(!is_first(job), job.parent ? 0 : 1, -job.work);
      };
      return rank(a) < rank(b);
    });
    return open;
  }

  /// @return whether a job was evaluated.
  bool take_one() {
    for (const Job& job : open_jobs()) {
      const fs::path file = queue_.claim(job.name);
      if (job.state == Job::State::claimed) {
        const auto state = look_at_claim(file, command_.lease_seconds);
        if (state && !state->is_lost) continue;
        if (state) drop_lost_claim(file);
      }
      const auto claim = Claim::take(file, command_.lease_seconds);
      if (!claim || fs::exists(queue_.result(job.name))) continue;
      evaluate(job);
      return true;
    }
    return false;
  }

  void evaluate(const Job& job) {
    if (!evaluator_) evaluator_ = std::make_unique<supersteps::PortionEvaluator>(queue_.plan());
    std::string owner = this_process();
    std::replace(owner.begin(), owner.end(), ' ', '.');
    const fs::path unnamed = queue_.folder() / "done" / ("." + job.name + "." + owner);
    const auto state = evaluator_->evaluate(job.portion, options_, unnamed);
    const bool is_new = commit(unnamed, queue_.result(job.name));
    std::string outcome = state.is_finished     ? "finished"
                          : state.halves() == 2 ? "divided in two"
                                                : "to be gone on with";
    if (!is_new) outcome = "was done by another already";
    out_ << fmt::format("job {}: {} in {:.1f} s, {}\n", job.name, counted(state.cells, "# cell[s]"),
                        state.seconds, outcome)
         << std::flush;
  }

  /// Whether somebody's claim has neither been touched nor ended since it was first seen here: it may be
  /// lost.
  bool has_to_watch() {
    bool watches = false;
    std::map<std::string, timespec> now;
    for (const Job& job : open_jobs()) {
      const auto state = look_at_claim(queue_.claim(job.name), command_.lease_seconds);
      if (!state) return true;  // just ended: look again
      const auto before = seen_.find(job.name);
      const bool is_alive = before != seen_.end() && (before->second.tv_sec != state->touched.tv_sec ||
                                                      before->second.tv_nsec != state->touched.tv_nsec);
      watches = watches || !is_alive;
      now[job.name] = before != seen_.end() ? before->second : state->touched;
    }
    seen_ = std::move(now);
    return watches;
  }
};

const char* name_of(const Job& job, const std::optional<ClaimState>& claim) {
  switch (job.state) {
    case Job::State::finished:
      return "finished";
    case Job::State::divided:
      return "divided";
    case Job::State::claimed:
      return claim && claim->is_lost ? "lost" : "running";
    default:
      return "to do";
  }
}

}  // namespace

bool work_on(Queue& queue, const QueueCommand& command, const supersteps::RunOptions& options,
             std::ostream& out) {
  if (command.job && *command.job >= queue.size())
    throw Error("--job " + std::to_string(*command.job) + ": the queue has " +
                counted(queue.size(), "# job[s], the first being 0"));
  return QueueWorker(queue, command, options, out).run();
}

void join_jobs(Queue& queue, bool partial, const fs::path& snapshot) {
  std::vector<supersteps::JoinedPortion> portions;
  std::string missing;
  std::size_t count = 0;
  for (const Job& job : queue.jobs()) {
    const bool is_there = job.state == Job::State::finished || job.state == Job::State::divided;
    portions.push_back(
        {job.portion, job.parent, is_there ? std::optional(queue.result(job.name)) : std::nullopt});
    if (is_there) continue;
    if (++count <= 10) missing.append(count > 1 ? ", " : "").append(job.name);
  }
  if (count > 10) missing += " and " + grouped(count - 10) + " more";
  if (count > 0 && !partial)
    throw Error("'" + queue.folder().string() + "' is not done: no result of " + counted(count, "job[s] ") +
                missing + counted(count, "; evaluate [it|them] with 'bsp2 jobs run ") +
                queue.folder().string() + counted(count, "', or leave [it|them] FUZZY with --partial"));
  supersteps::join_portions(queue.plan(), portions, snapshot);
}

void print_status(std::ostream& out, Queue& queue, bool all) {
  const std::vector<Job> jobs = queue.jobs();
  std::map<std::string, std::size_t> counts;
  std::string rows;
  double done = 0;
  std::uint64_t cells = 0;
  for (const Job& job : jobs) {
    const auto claim = job.state == Job::State::claimed
                           ? look_at_claim(queue.claim(job.name), QueueCommand().lease_seconds)
                           : std::nullopt;
    const std::string state = name_of(job, claim);
    const bool has_result = job.state == Job::State::finished || job.state == Job::State::divided;
    ++counts[state];
    cells += job.result.cells;
    if (job.state == Job::State::finished) done += job.work;
    if (!all && job.state != Job::State::claimed) continue;
    const std::string row =
        fmt::format("  {:<16} {:>6.2f} % {:<9} {:>12} {:>10} {:>9}  {}", job.name, 100 * job.work, state,
                    has_result ? grouped(job.result.cells) : "",
                    has_result && job.result.undecided > 0 ? grouped(job.result.undecided) : "",
                    has_result ? fmt::format("{:.1f} s", job.result.seconds) : "", claim ? claim->owner : "");
    rows += row.substr(0, row.find_last_not_of(' ') + 1) + '\n';
  }
  std::string summary;
  for (const auto& [state, count] : counts)
    summary += fmt::format("{}{} {}", summary.empty() ? "" : ", ", count, state);
  out << fmt::format("{}: {}: {}; {:.0f} % of the estimated work, {}\n", queue.folder().string(),
                     counted(jobs.size(), "# job[s]"), summary, 100 * done, counted(cells, "# IN cell[s]"));
  if (rows.empty()) return;
  out << fmt::format("\n  {:<16} {:>8} {:<9} {:>12} {:>10} {:>9}  {}\n", "job", "work", "state", "IN cells",
                     "undecided", "time", "where")
      << rows;
}

}  // namespace bsp2::jobs
