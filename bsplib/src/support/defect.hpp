#pragma once

/// Mutation switches. A test build of this layer sets BSP2_BSPLIB_DEFECT to one of these numbers and must
/// then fail the random-program test; every other build has none.
#ifndef BSP2_BSPLIB_DEFECT
#define BSP2_BSPLIB_DEFECT 0
#endif

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

inline constexpr Defect defect = static_cast<Defect>(BSP2_BSPLIB_DEFECT);

}  // namespace bsp2::bsplib
