#pragma once

#include <span>
#include <vector>

#include "bsp2/drawing/sheets/drawing.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"

namespace bsp2::api {

/// The lines of all views of a drawing, on the master. Each rank finds what is hidden of its share of their
/// edges, and puts the pieces of every so manyth view together.
/// Collective. h = (p - 1) times the size of the complexes, from the master.
/// @param brep, cuts those of the master; null and empty elsewhere.
/// @throws what drawing::pieces_of_views throws on one of them, on all ranks.
std::vector<drawing::ViewLines> shared_lines(const geometry::Brep* brep, std::span<const geometry::Brep> cuts,
                                             const drawing::DrawingOptions& options,
                                             supersteps::Ranks& ranks);

}  // namespace bsp2::api
