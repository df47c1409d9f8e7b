// The reader of .csg texts: any text is a model or an error with its place.
#include <string_view>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    bsp2::model::parse_csg({reinterpret_cast<const char*>(data), size}, "/nowhere/fuzz.csg");
  } catch (const bsp2::Error&) {
  }
  return 0;
}
