#pragma once

#include <iosfwd>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// How far a queue is, in 80 columns but for names. @param all a line a job, not only for those at work.
void print_status(std::ostream& out, const JobQueue& queue, bool all);

/// What became of a job that was evaluated here, in a line. @param is_new it is kept.
void print_outcome(std::ostream& out, const Job& job, bool is_new);

}  // namespace bsp2::jobs
