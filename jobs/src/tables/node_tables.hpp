#pragma once

#include <iosfwd>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// The paper's tables: one of run times over the numbers of nodes, then for each number of nodes one of
/// cells, boundary 2-cells and seconds of each node at each resolution. At most 80 columns for three
/// resolutions.
/// @param measured at each resolution, the last one the finest; all for the same numbers of nodes.
/// Source: the paper, tables 1 to 6.
/// @param brief the first table alone.
void print_tables(std::ostream& out, const std::vector<ClusterTable>& measured, bool brief = false);

/// What the surface takes on so many nodes, a column each.
void print_surface_table(std::ostream& out, const std::vector<SurfaceTable>& measured);

}  // namespace bsp2::jobs
