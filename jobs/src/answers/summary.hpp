#pragma once

#include <iosfwd>
#include <string>

#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::jobs {

/// What a run found, for people: at most 80 columns but for the model's name.
/// @param with_table also what each superstep cost.
void print_summary(std::ostream& out, const supersteps::RunReport& report, bool with_table);

/// Whether a run is such that one looks at its supersteps: a long one, or one on several ranks.
bool needs_table(const supersteps::RunReport& report);

/// What the simplices of a mesh of its dimension are called: 2 or 3.
std::string simplex_name(const supersteps::RunReport& report);

/// Figures about the kernel's work.
void print_stats(std::ostream& out, const supersteps::RunReport& report);

}  // namespace bsp2::jobs
