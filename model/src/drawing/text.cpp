#include "drawing/text.hpp"

#include "bsp2/geometry/support/module.hpp"
#include "drawing/text_module.hpp"

namespace bsp2::model {

TextOutlines text_outlines(const std::string& text, const TextStyle& style,
                           const std::function<void(std::string)>& warn) {
  return loaded_module<TextModule>(BSP2_MODULE_LAYOUT).text_outlines(text, style, warn);
}

}  // namespace bsp2::model
