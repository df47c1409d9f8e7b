#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "serving/scene.hpp"
#include "viewer/received.hpp"
#include "viewer/voxels.hpp"

namespace bsp2::api {

/// A region or piece message at a coarser level, see Detail. On a lattice, points go to the
/// nearest place; triangles of which two corners have become one are left out, and owners without any; other
/// triangles stay, so that what is closed stays closed. Points that are in one place in two messages are so
/// at each level of both. Of voxels, see Voxels, there are no edges, and the header says `voxels`: whose a
/// triangle is, is then whose most of its voxel is.
/// @param bytes as region_message and surface_messages make them.
/// @param level at least that of the lattice, or one of voxels from the finest one on; Detail::nothing: no
/// triangles.
std::string coarser(const std::string& bytes, int level);

/// A part as the page names it, of its number in a message.
std::int32_t part_named(std::uint32_t number);

/// The parts of what is opaque in a region message, ascending; -1: of no part.
std::vector<std::int32_t> parts_in(const Received& from);

/// A region message at its own level, but for what is opaque of some parts.
std::string without_parts(const std::string& bytes, const std::set<std::int32_t>& parts);

/// The voxels of a message: of what is opaque, and of what is not.
/// @param exponent of their edge, in steps of the message's places; else as small as they are worth counting.
std::vector<Voxels> voxels_of(const Received& from, std::optional<int> exponent = std::nullopt);

/// Puts a region or piece message into a scene, with its levels.
void put_detailed(Scene& scene, const std::string& key, std::string bytes);

}  // namespace bsp2::api
