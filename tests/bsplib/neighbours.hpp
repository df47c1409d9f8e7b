#pragma once

#include "bsp2/bsplib/world.hpp"

/// The ranks as a ring.
namespace bsp2::bsplib {

inline int next(const World& world) { return (world.pid() + 1) % world.nprocs(); }
inline int previous(const World& world) { return (world.pid() + world.nprocs() - 1) % world.nprocs(); }

}  // namespace bsp2::bsplib
