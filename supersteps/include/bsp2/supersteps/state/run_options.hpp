#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/order.hpp"

namespace bsp2::model {
struct Model;
}

namespace bsp2::geometry {
struct CellBatch;
}

namespace bsp2::meshing {
class SizeField;
}

namespace bsp2::supersteps {

/// Where the cells of all ranks go.
enum class Collect : std::uint8_t {
  automatic,  ///< to the master up to `cells_of_a_master` cells, else as `file`
  master,     ///< to the master's memory
  tree,       ///< to the master's memory, up a binary tree of masters
  file        ///< nowhere: each rank keeps its own and writes them itself
};
inline constexpr std::uint64_t cells_of_a_master = 200000;

struct RunResult;

/// What the next computation superstep begins with, and how long it may take. The cells do not depend on it.
struct Steering {
  Order order = Order::depth;
  std::vector<double> eye;               ///< as RunOptions::eye; ignored where it does not fit the dimension
  std::optional<double> budget_seconds;  ///< none: until all is decided
};

/// What to evaluate and how far.
struct RunOptions {
  std::filesystem::path model;  ///< its file, or what `text` is called in messages
  /// The model's text, if it is none of a file. What it names by relative paths is found from `model`'s
  /// folder. Only the master's counts. Shared, since options are copied.
  std::shared_ptr<const std::string> text;
  /// What was read of that text already, without `curved`: it need not be read again. Of this rank.
  std::shared_ptr<const model::Model> read;
  unsigned threads = 0;             ///< of each rank; 0: one a core
  std::optional<unsigned> regions;  ///< rounded up to a power of two; none: by the model
  std::optional<unsigned>
      most_regions;              ///< by the model, but no more than so many, rounded down to a power of two
  double coincidence = 1e-9;     ///< hyperplanes closer than this share of the bounding box are one
  bool curved = false;           ///< spheres, cylinders and circles of the text are truly round
  bool parts_by_colour = false;  ///< each colour is a part, called like it; else each `part` node is one
  Order order = Order::depth;
  std::vector<double> eye;  ///< D numbers: with Order::priority, what looks largest from here is refined
                            ///< first; and see `angle`
  std::optional<unsigned> level;    ///< stop at this depth of the BSP tree, the rest stays FUZZY
  std::optional<double> tolerance;  ///< round solids are refined until FUZZY cells are thinner than this
  /// Of that, shares by place, for D = 3: the middle of a cell looks up its own. Not with `angle`, and no
  /// snapshot keeps it.
  std::shared_ptr<const meshing::SizeField> tolerance_shares;
  std::optional<double> angle;           ///< or until they are seen thinner than this from `eye`, in degrees
  std::optional<double> budget_seconds;  ///< a computation superstep ends after this time
  std::optional<unsigned>
      steps;  ///< at most so many of them; none: 1 with a budget and no snapshot, else until all is decided
  std::optional<std::uint64_t> cells;  ///< the run ends at about this number of cells, FUZZY ones counted
  bool strict = false;  ///< a warning is an error, as soon as it is known, and before `on_cells`
  bool keep_in = true, keep_fuzzy = true, keep_out = false;  ///< which cells the mesh holds
  bool collect_cells = true;                                 ///< false: only measures, no mesh is held
  /// Of a solid of dimension 3 nothing is wanted but `boundary` and measures: where its surface can be found
  /// without cells, none are made; limits and steps are ignored there. With `resume` none are read if the
  /// snapshot holds the surface within the same limits.
  bool surface_only = false;
  /// Beside cells, `boundary` is found without them where that is known to take less than gluing them. It is
  /// the same.
  bool traces_boundary = false;
  std::optional<std::filesystem::path> snapshot;  ///< written after each computation superstep
  std::optional<std::filesystem::path>
      resume;  ///< goes on from this one; model, regions, coincidence, curved, parts and keep are its own
  /// Asked often: true ends the computation soon, and the run with a snapshot (if one is written) of what
  /// there is. The result has no cells then, and its report counts those that are finished.
  std::function<bool()> interrupted;
  /// After this time a rank that has nothing left to do ends the step of the others, so that regions move to
  /// it; none: never.
  std::optional<double> move_after_seconds = 1.0;
  std::vector<std::int32_t>
      first_rank_of_region;  ///< on the master: who begins with each region; empty: by estimated work
  Collect collect = Collect::automatic;
  bool boundary = false;      ///< resolution computes the surface of the IN cells (D = 3)
  bool faces = false;         ///< with `boundary`: its faces, and the interfaces between parts, too
  bool closes_parts = false;  ///< with `boundary`: `faces`, too, if the model is divided into parts
  bool outlines = false;      ///< with `boundary`: those of the IN cells' parts (D = 2)
  bool contacts = false;      ///< and which of them touch, and where (likewise)
  /// With `can_be_asked`, on several ranks, for D = 3: all make the complex that the result may be asked for,
  /// once, where the cells are, which it has no more then. It goes with Collect::file.
  bool complex = false;
  bool finds_rounds = true;  ///< the result tells pictures and CAD files what is round
  /// Told the share of the superstep at hand that is done, in [0, 1], and the cells of all ranks so far, 0
  /// where none are made; called on the master, from its main thread.
  std::function<void(double done, std::uint64_t cells)> on_progress;
  /// Told the cells of this rank as they are decided, in batches of some hundred; they stay as they are.
  /// Called by the main thread while the workers go on, which wait for it if it takes long.
  std::function<void(const std::shared_ptr<const geometry::CellBatch>& cells)> on_new_cells;
  /// Shown what there is after each computation superstep, FUZZY where it is undecided: mesh, trees and
  /// bounds, no figures. Each rank holds the cells of its own regions. Called on all ranks, so it may be
  /// collective. With it, a budget ends a step and not the run.
  std::function<void(const RunResult& now, unsigned step)> on_frame;
  /// Asked before each computation superstep how to go on, on the master, whose answer counts for all ranks:
  /// for those who watch, it says what they look at and when they want to see more. Takes the place of
  /// `order`, `eye` and `budget_seconds`; with an `angle` the eye stays, as the cells depend on it.
  std::function<Steering(unsigned step)> steer;
  /// Shown the finished cells as soon as all are where they belong, unless the run is interrupted: all but
  /// boundary and contacts, and the report without costs. Called on all ranks, so it may be collective. With
  /// it the result has no cells: resolution gives back the memory of each region that it has glued.
  std::function<void(RunResult& now)> on_cells;
  bool can_be_asked = false;   ///< the result answers questions (RunResult::asked), and keeps what that takes
  std::vector<double> points;  ///< D numbers each: where they are is answered at the end, by the master
                               ///< (which needs all cells)
};

}  // namespace bsp2::supersteps
