#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// The program `bsp2`. Results go to `out`; errors, warnings and progress to stderr; both on the master
/// alone. Collective: all ranks call it with the same arguments.
/// @return the exit code, equal on all ranks: 0 for success, 2 for the user's mistake, 1 for ours.
int program(const std::vector<std::string>& arguments, std::ostream& out, const Ranks& ranks);

/// Runs the program on the ranks that a launcher started. Also tells why they could not start.
int program(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace bsp2::jobs
