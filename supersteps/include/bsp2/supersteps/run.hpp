#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/geometry/boundary.hpp"
#include "bsp2/geometry/bsp_tree.hpp"
#include "bsp2/geometry/cell_batch.hpp"
#include "bsp2/geometry/contact.hpp"
#include "bsp2/supersteps/ranks.hpp"

namespace bsp2::supersteps {

enum class Order : std::uint8_t { depth, priority };

/// Where the cells of all ranks go.
enum class Collect : std::uint8_t {
  automatic,  ///< to the master up to `cells_of_a_master` cells, else as `file`
  master,     ///< to the master's memory
  tree,       ///< to the master's memory, up a binary tree of masters
  file        ///< nowhere: each rank keeps its own and writes them itself
};
inline constexpr std::uint64_t cells_of_a_master = 200000;

struct RunResult;

/// What to evaluate and how far.
struct RunOptions {
  std::filesystem::path model;
  unsigned threads = 0;                     ///< of each rank; 0: one a core
  std::optional<unsigned> regions;          ///< rounded up to a power of two; none: by the model
  double coincidence = 1e-9;                ///< hyperplanes closer than this share of the bounding box are one
  bool curved = false;                      ///< spheres, cylinders and circles of the text are truly round
  Order order = Order::depth;
  std::vector<double> eye;                  ///< D numbers: with Order::priority, what looks largest from here is refined first; and see `angle`
  std::optional<unsigned> level;            ///< stop at this depth of the BSP tree, the rest stays FUZZY
  std::optional<double> tolerance;          ///< round solids are refined until FUZZY cells are thinner than this
  std::optional<double> angle;              ///< or until they are seen thinner than this from `eye`, in degrees
  std::optional<double> budget_seconds;     ///< a computation superstep ends after this time
  std::optional<unsigned> steps;            ///< at most so many of them; none: 1 with a budget and no snapshot, else until all is decided
  std::optional<std::uint64_t> cells;       ///< the run ends at about this number of cells, FUZZY ones counted
  bool strict = false;                      ///< a warning is an error, as soon as it is known, and before `on_cells`
  bool keep_in = true, keep_fuzzy = true, keep_out = false;  ///< which cells the mesh holds
  bool collect_cells = true;                ///< false: only measures, no mesh is held
  std::optional<std::filesystem::path> snapshot;  ///< written after each computation superstep
  std::optional<std::filesystem::path> resume;    ///< goes on from this one; model, regions, coincidence, curved and keep are its own
  /// Asked often: true ends the computation soon, and the run with a snapshot (if one is written) of what there is. The result
  /// has no cells then, and its report counts those that are finished.
  std::function<bool()> interrupted;
  /// After this time a rank that has nothing left to do ends the step of the others, so that regions move to it; none: never.
  std::optional<double> move_after_seconds = 1.0;
  std::vector<std::int32_t> first_rank_of_region;   ///< on the master: who begins with each region; empty: by estimated work
  Collect collect = Collect::automatic;
  bool boundary = false;  ///< resolution computes the surface of the IN cells (D = 3)
  bool contacts = false;  ///< and which of them touch, and where (likewise)
  /// Told the share of the work of all ranks that is done, in [0, 1], and their cells so far; called on the master, from
  /// its main thread.
  std::function<void(double done, std::uint64_t cells)> on_progress;
  /// Shown what there is after each computation superstep, FUZZY where it is undecided: mesh, trees and bounds, no figures.
  /// Each rank holds the cells of its own regions. Called on all ranks, so it may be collective. With it, a budget ends a step
  /// and not the run.
  std::function<void(const RunResult& now, unsigned step)> on_frame;
  /// Shown the finished cells as soon as all are where they belong, unless the run is interrupted: all but boundary and
  /// contacts, and the report without costs. Called on all ranks, so it may be collective. With it the result has no cells:
  /// resolution gives back the memory of each region that it has glued.
  std::function<void(RunResult& now)> on_cells;
  std::vector<double> points;  ///< D numbers each: where they are is answered at the end, by the master (which needs all cells)
};

/// An output that could not be made. The others are made all the same.
struct FailedOutput {
  std::string text;
  bool is_users = false;       ///< a full disk, a path: else an error of ours
  std::filesystem::path file;  ///< that is not there, or another run's; empty: none of the program's own
};

/// The simplices that the cells of a mesh were cut into, in figures.
struct SimplexReport {
  std::uint64_t simplices = 0;
  double smallest_angle = 180;        ///< degrees: between two faces of a tetrahedron, or two sides of a triangle
  std::uint64_t incomplete_cells = 0; ///< cells of which something is left out: rounded to doubles it would be flat or inverted
  double left_out_volume = 0;         ///< of all these together

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & simplices & smallest_angle & incomplete_cells & left_out_volume;
  }
};

/// The surface of the IN cells in figures.
struct BoundaryReport {
  std::uint64_t triangles = 0;
  double area = 0.0;
  bool closed = false;  ///< every edge is used equally often in both directions: counted, not assumed
};

/// Integrals over a solid. Lengths are in model units; moments are about the origin.
struct Measures {
  double in_volume = 0.0, fuzzy_volume = 0.0;  ///< the true volume is between in and in + fuzzy
  std::vector<double> centroid;                ///< D: of the IN cells
  std::vector<std::vector<double>> inertia;    ///< (D+1) x (D+1): integrals of x_i x_j with x_0 = 1, over the IN cells
  /// While FUZZY cells remain, between which values the solid's own moments are: (D+1) x (D+1), least and most.
  std::vector<std::vector<double>> inertia_least, inertia_most;
};

/// What a `measure` of the model found, in the coordinates that its children have there.
struct NamedMeasures : Measures {
  std::string name;
  int dimension = 3;
};

/// A part of the model that has a name; the number is in the cell data.
struct NamedPart {
  std::int32_t part;
  std::string name;
};

/// A mesh of the model whose faces wind around some points more than once, or the wrong way round, while the volume counts each
/// point of a solid once.
struct OverlappingMesh {
  std::string place;                      ///< "file:line:column" in the model
  std::string file;                       ///< that it was imported from, or empty
  std::uint64_t part = 0, triangles = 0;
  std::optional<double> volume_by_faces;  ///< each point as often as the faces wind around it; nothing under a construct (a hull, a projection, ...)
};

/// What a run found; with several ranks, complete on the master. Lengths are in model units; moments are about the origin.
struct RunReport : Measures {
  std::string model;
  int dimension = 3;
  unsigned ranks = 1, threads = 1, regions = 1, level = 0;
  std::uint64_t primitives = 0, hyperplanes = 0;
  std::uint64_t in_cells = 0, fuzzy_cells = 0;
  std::optional<std::uint64_t> out_cells;    ///< when OUT cells are kept
  std::optional<double> tolerance;           ///< of round solids, given or chosen
  std::optional<double> angle;               ///< likewise, given: as seen from `eye`, in degrees
  std::vector<double> eye;
  std::vector<NamedPart> named_parts;        ///< in the order of their numbers
  std::vector<NamedMeasures> measures;       ///< on the master, in the order of the model
  std::vector<double> lower, upper;          ///< bounds of the IN cells; empty if there are none
  std::optional<BoundaryReport> boundary;    ///< when asked for
  std::optional<SimplexReport> simplices;    ///< of the mesh that was written, if it is of simplices
  std::string digest;                        ///< of the set of cells, order-independent
  bool complete = true;     ///< nothing is left undecided but what `level` leaves
  bool interrupted = false;
  std::vector<SuperstepRecord> supersteps;  ///< also those of earlier sessions
  std::vector<SuperstepRecord> earlier;     ///< only those: of the snapshot that was resumed
  std::uint64_t splits = 0, predicates = 0, exact_fallbacks = 0;
  double seconds = 0.0, cpu_seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::vector<std::string> warnings;
  std::vector<std::string> notes;       ///< what is as it should be, but may surprise
  std::vector<FailedOutput> failed;     ///< alike on all ranks
  std::vector<OverlappingMesh> overlapping_meshes;  ///< on the master, in the order of the model
};

/// The cells of a finished run.
struct SolidMesh {
  int dimension = 3;
  std::vector<std::shared_ptr<const geometry::CellBatch>> batches;  // shared: several consumers hold the same batches
};

/// Red, green, blue, opacity.
using Rgba = std::array<std::uint8_t, 4>;
inline constexpr Rgba uncoloured{237, 219, 189, 255};  ///< what has no colour of its own: stone

/// A box, D numbers each; empty vectors: none.
struct Bounds {
  std::vector<double> lower, upper;
};

/// Where a point is. See geometry::PointAnswer.
struct Answer {
  geometry::Label label = geometry::Label::out;
  std::int32_t part = geometry::no_part;  ///< of the cell
  double distance = 0;                    ///< to the nearest point that has, or may have, another label
  std::vector<double> nearest;            ///< such a point
};

/// What a rank holds after a run.
struct RunResult {
  RunReport report;
  bool is_collected = true;  ///< the master has all cells; else each rank has those of its regions
  SolidMesh mesh;
  geometry::BspTree tree;        ///< its leaves are the cells of the mesh, in the order of the batches
  geometry::BspTree partition;   ///< leaf k >= 1 is region k - 1
  std::vector<std::int32_t> rank_of_region;  ///< who computed it
  std::vector<std::optional<Rgba>> colour_of_part;  ///< as the model says; empty if it has no colours
  Bounds bounds;                 ///< of the model, before it is evaluated: they contain the solid
  std::optional<geometry::TriangleSurface> boundary;  ///< on the master, when asked for
  /// When asked for, the contacts that this rank found, by cells. Cells are counted through all regions in their order: as
  /// in the batches of the mesh, where it is collected.
  std::vector<geometry::Contact> contacts;
  std::vector<Answer> answers;                        ///< likewise, to RunOptions::points
};

/// Evaluates a model: the loop of supersteps. The cells depend on the model and the options, not on the number of ranks.
/// A snapshot that cannot be written and a boundary that cannot be found are told in the report; the rest is there.
/// Collective, within Ranks::together; the options are the same on all ranks. @throws bsp2::Error for the user's mistakes.
/// Source: the paper, section 4.2.
RunResult run(const RunOptions& options, Ranks& ranks);

/// The same by this process alone.
RunResult run(const RunOptions& options);

/// Makes one output of several, so that it takes nothing else along if it fails. Collective; with several ranks, only what they agreed on
/// (Ranks::agree, of which `work` is made) can be got over, and all else is thrown.
/// @return how it failed, alike on all ranks; nothing if it did not.
std::optional<FailedOutput> attempt(const Ranks& ranks, const std::function<void()>& work);

/// Fills in what the run cost up to now: the supersteps, time and memory of all ranks, on the master. Collective.
void record_costs(Ranks& ranks, RunReport& report);

}  // namespace bsp2::supersteps
