#pragma once

#include <iosfwd>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// What a run found, for people: at most 80 columns but for the model's name.
/// @param with_table also what each superstep cost.
void print_summary(std::ostream& out, const Figures& figures, bool with_table);

/// Whether a run is such that one looks at its supersteps: a long one, or one on several ranks.
bool needs_table(const Figures& figures);

/// Figures about the kernel's work.
void print_stats(std::ostream& out, const Figures& figures);

}  // namespace bsp2::jobs
