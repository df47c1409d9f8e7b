#pragma once

#include "outputs/outputs.hpp"

namespace bsp2::api {

/// Before anything is computed. @throws bsp2::Error for a file that cannot be written, or words that make no
/// sense.
void check_drawing(const DrawingOutput& output, std::string_view dashes);

/// Draws what a run has found and writes it, on the master; nothing where the boundary could not be found,
/// which is told. Collective. @throws bsp2::Error if it cannot be drawn.
void write_drawing(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks,
                   const Run& run, Written& written);

}  // namespace bsp2::api
