#pragma once

#include <string>

#include "bsp2/error.hpp"
#include "bsp2/evaluation.hpp"
#include "bsp2/expression.hpp"
#include "bsp2/figures.hpp"
#include "bsp2/formats.hpp"
#include "bsp2/outputs.hpp"
#include "bsp2/queue.hpp"
#include "bsp2/viewing.hpp"

/// Solids as expressions, evaluated to convex cells: the one header of whoever uses the library. Manual:
/// docs/api.md; what the nodes mean: docs/model.md and docs/expressions.md.
///
/// Threads: an Expression may be used by any number of threads, also at once. A Result is one thread's at a
/// time. Any number of evaluations may run at once, each with a Result of its own. With more than one rank
/// (Ranks) all calls are of the main thread, and those marked collective are made by all ranks in the same
/// order.
///
/// Errors: all that is thrown is a bsp2::Error, or std::bad_alloc.
///
/// Versions: semantic. Until 1.0 a new minor version may change what is declared here.
namespace bsp2 {

/// "major.minor.patch" of the library that is loaded.
BSP2_API std::string version();
/// Name and version of the MPI library that Ranks use, as "Open MPI v4.1.4". MPI need not have been started.
BSP2_API std::string mpi_version();

}  // namespace bsp2
