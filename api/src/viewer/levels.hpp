#pragma once

#include <string>

#include "serving/scene.hpp"

namespace bsp2::api {

/// A region or piece message on a coarser lattice, its level the exponent of the step. Points go to the
/// nearest place; triangles of which two corners have become one are left out, and owners without any; other
/// triangles stay, so that what is closed stays closed. Points that are in one place in two messages are so
/// at each level of both.
/// @param bytes as region_message and surface_messages make them.
/// @param level at least that of the lattice; Detail::nothing: no triangles.
std::string coarser(const std::string& bytes, int level);

/// Puts a region or piece message into a scene, with its levels.
void put_detailed(Scene& scene, const std::string& key, std::string bytes);

}  // namespace bsp2::api
