#pragma once

#include <optional>
#include <string_view>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// The colour that CSS calls so, in capital or small letters, or #rgb, #rgba, #rrggbb, #rrggbbaa; nothing if
/// it is none.
std::optional<Colour> colour_named(std::string_view text);

}  // namespace bsp2::model
