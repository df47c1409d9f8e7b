#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// The name of a colour in CSS, else #rrggbb, and two digits more where it is not opaque.
std::string name_of(const Colour& colour);

/// The colour that CSS calls so, in capital or small letters, or #rgb, #rgba, #rrggbb, #rrggbbaa; nothing if
/// it is none.
std::optional<Colour> colour_named(std::string_view text);

/// The names that CSS knows.
std::vector<std::string_view> colour_names();

}  // namespace bsp2::model
