#pragma once

#include <iosfwd>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// The supersteps for people, in at most 80 columns: the work of the ranks (least, median, most seconds
/// without waiting), h, the cells of all ranks, the longest time from begin to end, and what the cost model w
/// + g h + l says of it.
void print_supersteps(std::ostream& out, const std::vector<Superstep>& records);

}  // namespace bsp2::jobs
