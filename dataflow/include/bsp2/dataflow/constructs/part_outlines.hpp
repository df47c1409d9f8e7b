#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/surface/outline.hpp"

namespace bsp2::dataflow {

/// The outlines of the parts of a plane solid, by their numbers: those edges of the IN cells of each that do
/// not cancel. A path begins at its least corner, and paths are sorted by it.
/// @param batches all cells of the solid; other ones than IN do not count.
/// @throws std::logic_error that names the place if they do not close.
std::vector<geometry::PartOutline> part_outlines(
    const Network<2>& network, std::span<const std::shared_ptr<const geometry::CellBatch>> batches);

}  // namespace bsp2::dataflow
