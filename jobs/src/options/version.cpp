#include "options/version.hpp"

#include "bsp2/supersteps/ranks/ranks.hpp"
#include "libraries.hpp"

namespace bsp2::jobs {

std::string version_text() {
  return "bsp2 " BSP2_VERSION "\n" + supersteps::Ranks::library() + "\n" BSP2_LIBRARIES;
}

}  // namespace bsp2::jobs
