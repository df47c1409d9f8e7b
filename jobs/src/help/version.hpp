#pragma once

#include <string>

namespace bsp2::jobs {

/// "bsp2 0.1.0" and, on the next lines, the libraries that it was built with.
std::string version_text();

}  // namespace bsp2::jobs
