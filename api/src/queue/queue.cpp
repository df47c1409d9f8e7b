#include "queue/queue.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

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
  int looks = 0;  // at the regions that are enough: one may be held up by what else the machine does
  for (std::size_t count = 1; count <= regions.size() && looks < 2;) {
    supersteps::Portion sample{plan, {}};
    double work = 0;
    for (std::size_t i = 0; i < count; ++i) {  // all over the list: it is in the order of work
      const auto& region = regions[(2 * i + 1) * regions.size() / (2 * count)];
      sample.regions.push_back(region.region);
      work += region.work;
    }
    const auto state = evaluator.evaluate(sample, how, unnamed);
    if (!state.is_finished) break;
    const double found = state.seconds / work;
    if (found > 0) known = looks > 0 ? std::min(*known, found) : found;
    if (looks > 0 || state.seconds >= enough)
      ++looks;
    else
      count *= 4;
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
    QueuedJob planned;
    in >> planned.job.name >> planned.job.work;
    planned.portion.parent = plan();
    for (std::uint32_t region; in >> region;) planned.portion.regions.push_back(region);
    if (planned.job.name != std::to_string(planned_.size()) || planned.portion.regions.empty())
      throw Error("'" + (folder_ / "jobs.txt").string() + "' is damaged; split the model anew");
    planned_.push_back(std::move(planned));
  }
}

void tell(Job& job, const supersteps::PortionState& found) {
  job.state = found.is_finished ? Job::State::finished : Job::State::divided;
  job.halves = found.halves();
  job.cells = found.cells;
  job.undecided = found.undecided;
  job.seconds = found.seconds;
}

void Queue::add(std::vector<QueuedJob>& all, QueuedJob planned) {
  Job& job = planned.job;
  const fs::path file = result(job.name);
  auto known = results_.find(job.name);
  if (known == results_.end() && fs::exists(file))
    known = results_.emplace(job.name, supersteps::read_portion(file)).first;
  if (known == results_.end()) {
    job.state = fs::exists(claim(job.name)) ? Job::State::running : Job::State::waiting;
    all.push_back(std::move(planned));
    return;
  }
  const supersteps::PortionState& found = known->second;
  tell(job, found);
  QueuedJob half;
  half.parent = all.size();
  half.job.work = job.work / 2;
  half.portion.parent = file;
  const std::string name = job.name;
  all.push_back(std::move(planned));
  for (half.portion.half = 0; half.portion.half < found.halves(); ++half.portion.half) {
    half.job.name = name + "." + std::to_string(half.portion.half);
    add(all, half);
  }
}

std::vector<QueuedJob> Queue::jobs() {
  std::vector<QueuedJob> all;
  for (const QueuedJob& planned : planned_) add(all, planned);
  return all;
}

void join_jobs(Queue& queue, bool partial, const fs::path& snapshot) {
  std::vector<supersteps::JoinedPortion> portions;
  std::string missing;
  std::size_t count = 0;
  for (const QueuedJob& queued : queue.jobs()) {
    const std::string& name = queued.job.name;
    portions.push_back(
        {queued.portion, queued.parent, queued.is_open() ? std::nullopt : std::optional(queue.result(name))});
    if (!queued.is_open()) continue;
    if (++count <= 10) missing.append(count > 1 ? ", " : "").append(name);
  }
  if (count > 10) missing += " and " + grouped(count - 10) + " more";
  if (count > 0 && !partial)
    throw Error("'" + queue.folder().string() + "' is not done: no result of " + counted(count, "job[s] ") +
                missing + counted(count, "; evaluate [it|them] with 'bsp2 jobs run ") +
                queue.folder().string() + counted(count, "', or leave [it|them] FUZZY with --partial"));
  supersteps::join_portions(queue.plan(), portions, snapshot);
}

}  // namespace bsp2::api
