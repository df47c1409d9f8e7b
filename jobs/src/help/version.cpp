#include "help/version.hpp"

#include "bsp2/bsp2.hpp"
#include "libraries.hpp"

namespace bsp2::jobs {

std::string version_text() { return "bsp2 " BSP2_VERSION "\n" + mpi_version() + "\n" BSP2_LIBRARIES; }

}  // namespace bsp2::jobs
