#pragma once

#include <string>
#include <vector>

#include "bsp2/supersteps/state/run_result.hpp"
#include "ranks/exchange.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {

/// What only the cells and the boundary of a finished run can tell. On the master.
[[nodiscard]] std::vector<std::string> late_warnings(const RunReport& report, const Source& source,
                                                     const RunOptions& options);

/// With --strict, before anything is written. Collective. @throws bsp2::Error on all ranks if there are any.
void refuse_late_warnings(Ranks& ranks, const RunReport& report, const Source& source,
                          const RunOptions& options);

}  // namespace bsp2::supersteps
