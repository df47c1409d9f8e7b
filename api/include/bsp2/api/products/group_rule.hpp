#pragma once

#include <string>

#include "bsp2/meshing/groups/groups.hpp"

namespace bsp2::api {

/// Reads `NAME=PREDICATE`, a predicate being conditions that are joined by `&`:
///
///   x==min, z==max, y==2.5, x<=1     planes, and half-spaces along an axis
///   2*x + y - z <= 3                 any
///   colour==red, colour==#ff8800     faces of parts of this colour; one without opacity fits any
///   angle<=30                        divided where faces meet at more degrees: NAME_1, NAME_2, ...
///
/// @throws bsp2::Error that says what is wrong, and at which character.
meshing::GroupRule parse_group(const std::string& text);

}  // namespace bsp2::api
