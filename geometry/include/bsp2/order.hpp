#pragma once

#include <cstdint>

namespace bsp2 {

/// What is refined first.
enum class Order : std::uint8_t {
  depth,    ///< one cell is finished before the next: little memory
  priority  ///< the largest undecided cell: a coarse picture of the whole, soon
};

}  // namespace bsp2
