#include "answers/job_status.hpp"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <ostream>
#include <string>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {
namespace {

const char* name_of(Job::State state) {
  switch (state) {
    case Job::State::waiting:
      return "to do";
    case Job::State::running:
      return "running";
    case Job::State::lost:
      return "lost";
    case Job::State::divided:
      return "divided";
    case Job::State::finished:
      return "finished";
  }
  return "";
}

bool has_result(const Job& job) {
  return job.state == Job::State::finished || job.state == Job::State::divided;
}

std::string row_of(const Job& job) {
  const bool is_done = has_result(job);
  const std::string row = fmt::format("  {:<16} {:>6.2f} % {:<9} {:>12} {:>10} {:>9}  {}", job.name,
                                      100 * job.work, name_of(job.state), is_done ? grouped(job.cells) : "",
                                      is_done && job.undecided > 0 ? grouped(job.undecided) : "",
                                      is_done ? fmt::format("{:.1f} s", job.seconds) : "", job.owner);
  return row.substr(0, row.find_last_not_of(' ') + 1) + '\n';
}

}  // namespace

void print_status(std::ostream& out, const JobQueue& queue, bool all) {
  const std::vector<Job> jobs = queue.jobs();
  std::map<std::string, std::size_t> counts;
  std::string rows;
  double done = 0;
  std::uint64_t cells = 0;
  for (const Job& job : jobs) {
    ++counts[name_of(job.state)];
    cells += job.cells;
    if (job.state == Job::State::finished) done += job.work;
    if (all || job.state == Job::State::running || job.state == Job::State::lost) rows += row_of(job);
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

void print_outcome(std::ostream& out, const Job& job, bool is_new) {
  const char* outcome = !is_new                             ? "was done by another already"
                        : job.state == Job::State::finished ? "finished"
                        : job.halves == 2                   ? "divided in two"
                                                            : "to be gone on with";
  out << fmt::format("job {}: {} in {:.1f} s, {}\n", job.name, counted(job.cells, "# cell[s]"), job.seconds,
                     outcome)
      << std::flush;
}

}  // namespace bsp2::jobs
