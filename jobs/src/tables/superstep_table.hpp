#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "bsp2/supersteps/ranks/ranks.hpp"

namespace bsp2::jobs {

/// The supersteps for people, in at most 80 columns: the work of the ranks (least, median, most seconds
/// without waiting), h, the cells of all ranks, the longest time from begin to end, and what the cost model w
/// + g h + l says of it.
void print_supersteps(std::ostream& out, const std::vector<supersteps::SuperstepRecord>& records);

/// All that was recorded, one line a superstep and rank.
std::string to_csv(const std::vector<supersteps::SuperstepRecord>& records);

}  // namespace bsp2::jobs
