#pragma once

#include <cstddef>
#include <string>

namespace bsp2::bsplib {

/// "1 byte", "8 bytes", for messages.
inline std::string bytes_text(std::size_t bytes) {
  return std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes");
}

}  // namespace bsp2::bsplib
