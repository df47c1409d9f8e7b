#pragma once

#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "bsp2/supersteps/state/run_options.hpp"

namespace bsp2 {

/// What the rooms are asked for. @throws Error for options that make no sense.
supersteps::RunOptions run_options(const Options& options);

/// Likewise of an expression. @param warnings gets those of the files that are in it.
supersteps::RunOptions run_options(const Expression& expression, const Options& options,
                                   std::vector<std::string>& warnings);

}  // namespace bsp2
