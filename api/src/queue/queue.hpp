#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "bsp2/supersteps/loop/portions.hpp"

/// A queue of independent jobs in a folder that all machines see.
///
///   plan.h5       the model, its options and regions (a snapshot, nothing computed)
///   jobs.txt      a line a job: its number, estimated work, and regions; the
///                 biggest first; written last, never changed
///   claims/NAME   somebody evaluates this job; touched now and then while he lives
///   done/NAME.h5  what a job found; appears as a whole, once, and never changes
///
/// Only `done` is the truth; claims merely keep work from being done twice. A job that is evaluated twice
/// (its claim was thought lost) is committed once: the second result is thrown away. A job that was not
/// finished when its result was written is divided: what is left are the jobs NAME.0 and NAME.1, which follow
/// from the result alone.
namespace bsp2::api {

/// A job, and what it evaluates.
struct QueuedJob {
  Job job;  ///< `running` also if its claim may be lost: nobody has looked
  supersteps::Portion portion;
  std::optional<std::size_t> parent;  ///< among all jobs of the list
  [[nodiscard]] bool is_open() const { return job.state < Job::State::divided; }
};

/// What the result of a job tells of it.
void tell(Job& job, const supersteps::PortionState& found);

class Queue {
 public:
  /// Makes a queue. @throws bsp2::Error if the folder has something in it, or if the model cannot be
  /// evaluated.
  /// @param job_seconds regions share a job until it is about so much work for one thread of this machine, as
  /// far as a look at some of them tells; 0: a job a region.
  static void split(const supersteps::RunOptions& options, const std::filesystem::path& folder,
                    double job_seconds);

  /// Opens a queue. @throws bsp2::Error if there is none.
  explicit Queue(std::filesystem::path folder);

  [[nodiscard]] std::filesystem::path plan() const { return folder_ / "plan.h5"; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::size_t size() const { return planned_.size(); }
  /// All jobs, each before those it was divided into. @throws bsp2::Error if a result cannot be read.
  std::vector<QueuedJob> jobs();
  [[nodiscard]] std::filesystem::path result(const std::string& name) const {
    return folder_ / "done" / (name + ".h5");
  }
  [[nodiscard]] std::filesystem::path claim(const std::string& name) const {
    return folder_ / "claims" / name;
  }

 private:
  std::filesystem::path folder_;
  std::vector<QueuedJob> planned_;
  std::map<std::string, supersteps::PortionState> results_;  // they never change

  void add(std::vector<QueuedJob>& all, QueuedJob planned);
};

/// Claims and evaluates jobs until none is left to take. Not collective: any number of processes do this at
/// the same time. Before it ends it waits for claims of others, until they are touched, end, or prove to be
/// lost.
/// @return whether it was stopped; what was found until then is committed.
/// @throws bsp2::Error if a file cannot be read or written.
bool work_on(Queue& queue, const WorkOptions& options);

/// Puts the results together as a snapshot, which a run then resumes.
/// @throws bsp2::Error that names the jobs that are missing, unless what they have to do may stay FUZZY.
void join_jobs(Queue& queue, bool partial, const std::filesystem::path& snapshot);

}  // namespace bsp2::api
