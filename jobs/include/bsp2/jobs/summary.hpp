#pragma once

#include <iosfwd>

#include "bsp2/supersteps/run.hpp"

namespace bsp2::jobs {

/// What a run found and the table of its supersteps, for people: at most 80 columns but for the model's name.
void print_summary(std::ostream& out, const supersteps::RunReport& report);

/// Figures about the kernel's work.
void print_stats(std::ostream& out, const supersteps::RunReport& report);

}  // namespace bsp2::jobs
