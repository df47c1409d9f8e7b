#pragma once

#ifdef BSP2_BSPLIB_DEFECTS
#include <cstdlib>
#endif

/// Mutation switches. A test build of this layer (BSP2_BSPLIB_DEFECTS) takes the number of one of them from
/// the environment, BSP2_BSPLIB_DEFECT, and must then fail the random-program test; every other build has
/// none, and nothing of them.

namespace bsp2::bsplib {

enum class Defect {
  none,
  drop_put,            ///< the last put of a stream is lost
  gets_after_puts,     ///< gets read what puts have written
  swap_messages,       ///< the first two messages of a rank change places
  forget_pop,          ///< a popped registration stays in effect
  late_put,            ///< put reads its source at the sync, not at the call
  early_tagsize,       ///< a new tag size takes effect at once
  early_registration,  ///< a registration takes effect at once
  puts_in_reverse,     ///< of overlapping puts the lowest rank wins
  merge_wrongly,       ///< neighbouring puts merge although a gap of a byte is between them
  lose_message         ///< the last of several messages in one record is lost
};

#ifdef BSP2_BSPLIB_DEFECTS
inline Defect defect_of_environment() {
  const char* number = std::getenv("BSP2_BSPLIB_DEFECT");
  return number == nullptr ? Defect::none : static_cast<Defect>(std::atoi(number));
}
inline const Defect defect = defect_of_environment();
#else
inline constexpr Defect defect = Defect::none;
#endif

}  // namespace bsp2::bsplib
