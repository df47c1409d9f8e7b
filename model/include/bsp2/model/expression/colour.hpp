#pragma once

#include <string>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// The name of a colour in CSS, else #rrggbb, and two digits more where it is not opaque.
std::string name_of(const Colour& colour);

}  // namespace bsp2::model
