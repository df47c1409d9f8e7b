#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "bsp2/supersteps/state/run_options.hpp"

namespace bsp2 {

/// @throws Error unless it is finite and above 0, if it is there.
void check_positive(const char* name, const std::optional<double>& number);

/// What the rooms are asked for. @throws Error for options that make no sense.
supersteps::RunOptions run_options(const Options& options);

/// Likewise of an expression. @param warnings gets those of the files that are in it.
supersteps::RunOptions run_options(const Expression& expression, const Options& options,
                                   std::vector<std::string>& warnings);

}  // namespace bsp2
