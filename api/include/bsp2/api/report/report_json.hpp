#pragma once

#include <string>

#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

/// A report as the text of report.json. Numbers round-trip; a number that does not exist is null.
std::string to_json(const supersteps::RunReport& report);

}  // namespace bsp2::api
