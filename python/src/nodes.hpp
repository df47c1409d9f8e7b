#pragma once

#include "arguments.hpp"

namespace bsp2::python {

/// Expressions, and the functions that make them.
void add_nodes(py::module_& m);

}  // namespace bsp2::python
