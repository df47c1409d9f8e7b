#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/supersteps/state/run_options.hpp"

namespace bsp2::supersteps {

/// What one node of a cluster would find and need: the regions that one of so many ranks gets, evaluated
/// alone.
struct NodeFigures {
  std::uint64_t cells = 0;   ///< IN and FUZZY
  std::uint64_t facets = 0;  ///< 2-cells of their boundary: no other cell of the node covers them wholly; D =
                             ///< 3, else 0; only if wanted
  /// Work that can be counted, whatever else the machine does: splits of cells, questions on which side
  /// points are.
  std::uint64_t splits = 0, predicates = 0;
  double seconds =
      0;  ///< of processor for the superstep computation, for each thread; the least of up to five times
};

/// One resolution of a model.
struct Resolved {
  std::optional<unsigned> level;  ///< none: to the end
  unsigned regions = 0;
  std::vector<std::vector<NodeFigures>> nodes;  ///< for each number of nodes
  /// For each number of nodes: of processor for what a node does of the distribution, on one thread; the most
  /// of up to eight nodes that find regions, evenly chosen. What travels, and making the cells of regions
  /// that come from others, is not in it.
  std::vector<double> distribution_seconds;
};

/// The measurements behind the paper's tables 1 to 6: for each resolution and each number of nodes, the
/// figures of each node. The groups of regions are those that a run on so many ranks would have; each is
/// evaluated by this process alone, one after the other, so the seconds are those of a cluster of such
/// machines, on which nobody else works.
///
/// Not collective: by one process.
/// @param levels the resolutions; empty: three, at the levels above which 5 % and 25 % of the cells lie, and
/// to the end.
/// @param with_facets whether boundaries are counted, which takes longer than the solid.
/// @throws bsp2::Error as run.
/// Source: the paper, section 5 and appendix A.
std::vector<Resolved> measure_tables(const RunOptions& options, const std::vector<unsigned>& node_counts,
                                     std::vector<std::optional<unsigned>> levels, bool with_facets = true);

/// What the surface costs so many nodes where it is found without cells. Seconds of processor for each
/// thread, the least of three times: of each step of each node. Nodes wait for each other at the end of a
/// step.
struct SurfaceFigures {
  unsigned nodes = 0;
  std::vector<std::vector<double>> tracing;     ///< one step: the superstep computation
  std::vector<std::vector<double>> resolution;  ///< points, corners, triangles of a node's own faces
  double joining = 0;  ///< of the master, on one thread: triangles of all in one list
  std::uint64_t triangles = 0;
  std::string digest;  ///< of the surface, the same for any number of nodes

  /// How long all take for some steps: the sum of the most of a node.
  [[nodiscard]] static double most(const std::vector<std::vector<double>>& steps);
  [[nodiscard]] static double mean(const std::vector<std::vector<double>>& steps);
};

/// Measures the surface on so many nodes, one node after the other. Not collective: by one process.
/// @throws bsp2::Error as run, and where the surface is not found without cells.
std::vector<SurfaceFigures> measure_surface(const RunOptions& options,
                                            const std::vector<unsigned>& node_counts);

}  // namespace bsp2::supersteps
