#pragma once

// What the tests of texts in .csg share.

#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"

namespace bsp2::model {

inline Model parse(const std::string& text) { return parse_csg(text, "test.csg"); }

/// What reading the text fails with.
inline std::string message(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace bsp2::model
