#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "bsp2/supersteps/run.hpp"

namespace bsp2::jobs {

/// The program `bsp2` but for what evaluates a model, so that it can be tested without one.
/// Results go to `out`; errors, warnings and progress to stderr.
/// @return the exit code: 0 for success, 2 for the user's mistake, 1 for ours.
int program(const std::vector<std::string>& arguments, std::ostream& out,
            const std::function<supersteps::RunResult(const supersteps::RunOptions&)>& run);

}  // namespace bsp2::jobs
