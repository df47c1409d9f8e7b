#pragma once

#include <atomic>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "surface/surface_tracer.hpp"

namespace bsp2::dataflow {

/// Appends the surface in some boxes, which do not overlap, found by the cells there.
/// @param stop somebody else ends the work by it: the skin is not complete then.
void add_skin_of_cells(const Network<3>& network, const std::vector<std::vector<HotBox>>& boxes,
                       unsigned threads, const std::atomic<bool>& stop, geometry::Skin& skin);

}  // namespace bsp2::dataflow
