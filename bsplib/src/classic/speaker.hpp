#pragma once

namespace bsp2::bsplib::classic {

/// Which process tells of a mistake that several make: the lowest of those that make it within 0.3 s.
///
/// Not collective: whoever is about to end the program calls it, on its own, before it prints. The lowest
/// process of all does not wait, another one 0.3 s at most for a lower one to speak up.
/// @param processes that take part, the first ones of MPI_COMM_WORLD.
/// Returns where this process is to print its message and end all. Where another one does so it does not
/// return, unless that one fails to for several seconds.
void wait_to_speak(int processes);

}  // namespace bsp2::bsplib::classic
