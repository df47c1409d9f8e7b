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

namespace bsp2::supersteps {

enum class Order : std::uint8_t { depth, priority };

/// What to evaluate and how far.
struct RunOptions {
  std::filesystem::path model;
  unsigned threads = 0;                     ///< 0: one a core
  std::optional<unsigned> regions;          ///< rounded up to a power of two; none: 1
  double coincidence = 1e-9;                ///< hyperplanes closer than this share of the bounding box are one
  Order order = Order::depth;
  std::optional<unsigned> level;            ///< stop at this depth of the BSP tree, the rest stays FUZZY
  std::optional<double> budget_seconds;     ///< a computation superstep ends after this time
  std::optional<std::uint64_t> cells;       ///< stop at about this number of cells
  bool keep_in = true, keep_fuzzy = true, keep_out = false;  ///< which cells the mesh holds
  bool collect_cells = true;                ///< false: only measures, no mesh is held
  bool boundary = false;                    ///< resolution computes the surface of the IN cells (D = 3, collect_cells)
  bool contacts = false;                    ///< and which of them touch, and where (likewise)
  /// Told the share of the work that is done, in [0, 1], and the cells so far; called from the main thread.
  std::function<void(double done, std::uint64_t cells)> on_progress;
};

/// Seconds, bytes and cells of one superstep, one value a rank.
struct SuperstepRecord {
  std::string name;
  unsigned step = 0;
  std::vector<double> seconds;
  std::vector<std::uint64_t> bytes_sent, bytes_received, cells;
  double predicted_seconds = 0.0;
};

/// The surface of the IN cells in figures.
struct BoundaryReport {
  std::uint64_t triangles = 0;
  double area = 0.0;
  bool closed = false;  ///< every edge is used equally often in both directions: counted, not assumed
};

/// What a run found. Lengths are in model units; moments are about the origin.
struct RunReport {
  std::string model;
  int dimension = 3;
  unsigned ranks = 1, threads = 1, regions = 1, level = 0;
  std::uint64_t primitives = 0, hyperplanes = 0;
  std::uint64_t in_cells = 0, fuzzy_cells = 0;
  std::optional<std::uint64_t> out_cells;    ///< when OUT cells are kept
  double in_volume = 0.0, fuzzy_volume = 0.0;
  std::vector<double> centroid;              ///< D
  std::vector<std::vector<double>> inertia;  ///< (D+1) x (D+1): integrals of x_i x_j with x_0 = 1
  std::vector<double> lower, upper;          ///< bounds of the IN cells; empty if there are none
  std::optional<BoundaryReport> boundary;    ///< when asked for
  std::string digest;                        ///< of the set of cells, order-independent
  std::vector<SuperstepRecord> supersteps;
  std::uint64_t splits = 0, predicates = 0, exact_fallbacks = 0;
  double seconds = 0.0, cpu_seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::vector<std::string> warnings;
};

/// The cells of a finished run, and a BSP order of them.
struct SolidMesh {
  int dimension = 3;
  std::vector<std::shared_ptr<const geometry::CellBatch>> batches;  // shared: several consumers hold the same batches
};

struct RunResult {
  RunReport report;
  SolidMesh mesh;
  geometry::BspTree tree;  ///< its leaves are the cells of the mesh, in the order of the batches
  std::optional<geometry::TriangleSurface> boundary;  ///< when asked for
  std::vector<geometry::Contact> contacts;            ///< when asked for, by cells; these count through the batches
};

/// Evaluates a model: the loop of supersteps.
/// Collective: all ranks call it. @throws bsp2::Error for the user's mistakes, on all ranks.
/// Source: the paper, section 4.2.
RunResult run(const RunOptions& options);

}  // namespace bsp2::supersteps
