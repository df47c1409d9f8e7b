#pragma once

#include <filesystem>
#include <optional>

#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::io {
struct VtuOptions;
}

namespace bsp2::supersteps {

/// How the cells of a run are written: by whom they were computed, colours and names.
io::VtuOptions vtu_options(const RunResult& result);

/// Writes the cells of a run as one VTK unstructured grid: every rank the pieces that it holds, the master
/// the `.pvtu`.
///
/// Collective, within Ranks::together. Nothing appears under its name before all ranks have written all they
/// have.
/// @param step of what the cells are, for the record of costs.
/// @param pvtu a path that ends in `.pvtu`, in a folder that exists and that all ranks see.
/// @return of the simplices, if there are any; on all ranks.
/// @throws bsp2::Error if a file cannot be written, and if the dimension is above 3; with several ranks
/// AgreedFailure. Source: the paper, section 4.2, "Collection".
SimplexReport write_mesh(Ranks& ranks, const RunResult& result, const std::filesystem::path& pvtu,
                         bool tets = false, unsigned step = 0);

/// Writes the surface of a run, or its faces, or of a plane solid its outlines, in the format that the file's
/// ending names. On the master. The report gets what there is to tell of it.
/// @pre what the format holds has been found (RunOptions::boundary, or `faces` or `outlines` as well).
/// @param clean of triangles: no edge shorter, no triangle thinner than this (model/mesh/cleaning.hpp); 0: as
/// they are; nothing: what the format can hold, io::least_step. @param threads that look for crossings.
/// @throws bsp2::Error if the file cannot be written.
void write_boundary(RunResult& result, const std::filesystem::path& path, std::optional<double> clean = {},
                    unsigned threads = 1);

}  // namespace bsp2::supersteps
