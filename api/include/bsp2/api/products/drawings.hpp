#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/drawing/sheets/drawing.hpp"
#include "bsp2/outputs.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

using Run = std::function<supersteps::RunResult(const supersteps::RunOptions&, supersteps::Ranks&)>;

/// What the words of a user mean. @param dashes before names of options in messages: "--" in those of the
/// program. @throws bsp2::Error for what makes no sense.
drawing::DrawingOptions drawing_options(const DrawingOptions& words, std::string_view dashes = "");

/// Draws what a run has found, on the master (elsewhere the drawing is empty); for each section the model is
/// run again without what is in front of it. Collective.
/// @param run_options of the run. @param result with faces. @throws bsp2::Error if it cannot be drawn.
drawing::Drawing draw(const supersteps::RunOptions& run_options, drawing::DrawingOptions options,
                      const supersteps::RunResult& result, supersteps::Ranks& ranks, const Run& run,
                      std::string_view dashes = "");

/// What is odd about the faces that were drawn.
std::vector<std::string> warnings_of_drawing(const supersteps::RunResult& result);

}  // namespace bsp2::api
