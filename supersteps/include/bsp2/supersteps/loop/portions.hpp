#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "bsp2/supersteps/state/run_options.hpp"

/// A run cut into portions that processes evaluate independently, whenever they like; then all are put
/// together.
///
/// A *plan* is a snapshot of a run in which nothing has been computed. A portion is a part of what a plan, or
/// another portion, has left; its result is a snapshot of that part alone. A portion that was not finished is
/// divided: what it has left is one or two further portions. Which, depends on its result alone. Source: the
/// paper, section 4.2 (more portions than nodes: a queue of independent jobs).
namespace bsp2::supersteps {

/// Estimated work on a region, in no unit; 0 where nothing is undecided.
struct RegionWork {
  std::uint32_t region = 0;
  double work = 0;
};

/// Compiles and distributes a model, and writes the plan. Not collective.
/// @return all regions, the one with most work first.
/// @throws bsp2::Error as run, and if the file cannot be written.
std::vector<RegionWork> make_plan(const RunOptions& options, const std::filesystem::path& plan);

/// What a portion is made of.
struct Portion {
  std::filesystem::path parent;        ///< the plan, or the result of the portion that was divided
  std::vector<std::uint32_t> regions;  ///< of a plan
  int half = 0;                        ///< of a divided portion: 0, or 1 where there are two
};

/// What the result of a portion tells of itself.
struct PortionState {
  bool is_finished = false;     ///< nothing is left but what the plan's level leaves
  std::uint64_t cells = 0;      ///< IN cells
  std::uint64_t undecided = 0;  ///< FUZZY cells that are left
  std::uint64_t open = 0;  ///< of them those that are to be gone on with: not yet deep, thin or small enough
  double seconds = 0;      ///< of the computation
  /// How many portions go on with what is left: 0, 1 or 2.
  [[nodiscard]] int halves() const { return is_finished ? 0 : open > 1 ? 2 : 1; }
};
/// @throws bsp2::Error if the file is no result of a portion.
PortionState read_portion(const std::filesystem::path& result);

/// Evaluates portions of one plan, one after the other; the model is compiled once. Not collective, not
/// thread safe.
class PortionEvaluator {
 public:
  /// @throws bsp2::Error if the plan cannot be read, or was written by a program that compiles the model
  /// differently.
  explicit PortionEvaluator(const std::filesystem::path& plan);
  ~PortionEvaluator();
  PortionEvaluator(const PortionEvaluator&) = delete;
  PortionEvaluator& operator=(const PortionEvaluator&) = delete;

  /// Evaluates a portion and writes its result: to the end, or until the budget has passed and there is
  /// something to divide, or until the interruption.
  /// @param options threads, order, budget and interruption; all else is the plan's.
  /// @throws bsp2::Error if a file cannot be read or written.
  PortionState evaluate(const Portion& portion, const RunOptions& options,
                        const std::filesystem::path& result);

  class Implementation;

 private:
  std::unique_ptr<Implementation> implementation_;
};

/// A portion and, if it has been evaluated, its result.
struct JoinedPortion {
  Portion portion;
  std::optional<std::size_t> parent;  ///< the place among all of the portion it is a half of; before its own
  std::optional<std::filesystem::path> result;
};

/// Puts all portions of a plan together as one snapshot; a run that resumes it finishes what only the whole
/// can: the joins across portions. Where results are missing, what they went on from is left to do. Not
/// collective. Holds all cells in memory.
/// @throws bsp2::Error if a file cannot be read or written, or if the portions do not make up the plan.
void join_portions(const std::filesystem::path& plan, const std::vector<JoinedPortion>& portions,
                   const std::filesystem::path& snapshot);

}  // namespace bsp2::supersteps
