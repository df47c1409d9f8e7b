#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/evaluation.hpp"

/// Many machines: a queue of jobs, where they come and go and none waits for another (docs/slurm.md), and how
/// a model would do on a cluster. Part of bsp2.hpp, which says what holds of all.
namespace bsp2 {

/// One job of a queue, as its folder tells of it now.
struct Job {
  enum class State : std::uint8_t { waiting, running, lost, divided, finished };
  std::string name;  ///< "17"; what it was divided into is called "17.0" and "17.1"
  double work = 0;   ///< share of the estimated work of all
  State state = State::waiting;
  int halves = 0;               ///< of a divided one: 2, or 1 if one job goes on with what it left
  std::uint64_t cells = 0;      ///< IN cells that it found
  std::uint64_t undecided = 0;  ///< FUZZY cells that it left
  double seconds = 0;           ///< of its computation
  std::string owner;            ///< who is, or was last seen, at it: host and process
};

/// What a worker of a queue does.
struct WorkOptions {
  unsigned threads = 0;                ///< 0: one a core
  double budget = 60;                  ///< seconds after which a job is divided
  std::optional<std::uint64_t> cells;  ///< or when it has about so many
  std::optional<std::uint32_t> job;    ///< this one first, and what it is divided into
  bool until_empty = true;             ///< then all others; without `job` always
  double lease = 120;                  ///< seconds after which a job whose worker gave no sign is taken again
  std::function<bool()> stop;          ///< as Options::stop
  /// Told of each job that was evaluated here. @param is_new false: somebody else's result was there already,
  /// and is kept.
  std::function<void(const Job&, bool is_new)> done;
};

/// A model as a queue of jobs, in a folder that all machines see. Any number of processes work on one at the
/// same time; an object and its copies are one thread's at a time.
class BSP2_API JobQueue {
 public:
  /// Makes one. @param job_seconds regions share a job until it is about so much work for one thread; 0: a
  /// job a region. @param options regions, level, tolerance, coincidence, curved, parts and keep.
  /// @throws Error as `evaluate`, and if the folder is there and has something in it.
  static JobQueue split(const Expression& expression, const std::filesystem::path& folder,
                        double job_seconds = 1, const Options& options = {});
  /// Opens one. @throws Error if there is none.
  explicit JobQueue(std::filesystem::path folder);

  [[nodiscard]] const std::filesystem::path& folder() const;
  [[nodiscard]] std::size_t size() const;  ///< jobs that it was split into
  /// Each before those that it was divided into. Lost is one whose worker gave no sign for 120 s.
  [[nodiscard]] std::vector<Job> jobs() const;

  /// Claims and evaluates jobs until none is left to take.
  /// @return whether it was stopped: what was found until then is kept. @throws Error if a file cannot be
  /// read or written.
  bool work(const WorkOptions& options = {}) const;

  /// Puts all results together as a snapshot, with which `resume` has the cells of `evaluate`. @param partial
  /// what is missing is FUZZY there (with Options::steps = 0 it stays so).
  /// @throws Error that names the jobs that are missing, unless `partial`.
  void join(const std::filesystem::path& snapshot, bool partial = false) const;

  class Implementation;

 private:
  std::shared_ptr<Implementation> implementation_;
};

/// What one node of a cluster would find and need: the regions that it gets, evaluated alone.
struct NodeFigures {
  std::uint64_t cells = 0;                   ///< IN and FUZZY
  std::uint64_t facets = 0;                  ///< of their boundary; D = 3, else 0
  std::uint64_t splits = 0, predicates = 0;  ///< cells that were cut; questions on which side a point is
  double seconds = 0;  ///< of processor for the computation, for each thread; the least of up to five times
};

/// One resolution of a model.
struct ClusterTable {
  std::optional<unsigned> level;  ///< none: to the end
  unsigned regions = 0;
  std::vector<std::vector<NodeFigures>> nodes;  ///< for each number of nodes: of each
  /// For each number of nodes: seconds of processor of what a node does to find its regions; the most of up
  /// to eight nodes.
  std::vector<double> distribution_seconds;
};

/// The measurements behind tables 1 to 6 of the paper: the nodes of a cluster are measured one after the
/// other, by this process alone.
/// @param node_counts how many nodes. @param levels resolutions, none: to the end; empty: three, above two of
/// which 5 % and 25 % of the cells lie. @param with_facets count them, which takes longer than the solid.
/// @throws Error as `evaluate`.
BSP2_API std::vector<ClusterTable> measure_tables(const Expression& expression,
                                                  const std::vector<unsigned>& node_counts = {1, 2, 4, 8, 16},
                                                  const std::vector<std::optional<unsigned>>& levels = {},
                                                  bool with_facets = true, const Options& options = {});

/// What one node after the other takes for the surface, where that is found without cells. Seconds of
/// processor for each thread, the least of three times.
struct SurfaceTable {
  unsigned nodes = 0;
  /// Finding it, and putting it together from there to triangles: the mean of the nodes, and what all take
  /// that wait for the slowest one at the end of each step.
  double tracing = 0, slowest_tracing = 0, resolution = 0, slowest_resolution = 0;
  double joining = 0;  ///< by the master alone: the triangles of all in one list
  std::uint64_t triangles = 0;
};

/// What the surface of a solid takes on so many nodes, as `measure_tables` says it of cells.
/// @throws Error as `evaluate`, and where the surface is not found without cells.
BSP2_API std::vector<SurfaceTable> measure_surface(const Expression& expression,
                                                   const std::vector<unsigned>& node_counts,
                                                   const Options& options = {});

}  // namespace bsp2
