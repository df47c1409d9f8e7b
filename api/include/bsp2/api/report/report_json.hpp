#pragma once

#include <string>
#include <vector>

#include "bsp2/figures.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

/// A report as the text of report.json. Numbers round-trip; a number that does not exist is null.
/// @param mesh that was made of the cells, or null.
std::string to_json(const supersteps::RunReport& report, const MeshFigures* mesh = nullptr);

/// Likewise, of a mesh that was looked at.
std::string to_json(const MeshCheck& check);

/// All that was recorded, one line a superstep and rank.
std::string to_csv(const std::vector<supersteps::SuperstepRecord>& records);

/// A report as the user sees it.
Figures figures_in(const supersteps::RunReport& report);
Measures measures_of(const supersteps::Measures& found);
std::vector<Part> parts_of(const supersteps::RunReport& report);

}  // namespace bsp2::api
