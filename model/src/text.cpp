#include "text.hpp"

#include "bsp2/geometry/module.hpp"
#include "text_module.hpp"

namespace bsp2::model {

TextOutlines text_outlines(const std::string& text, const TextStyle& style, const std::function<void(std::string)>& warn) {
  static const void* const module = load_module("bsp2-text", module_folder(), BSP2_MODULE_LAYOUT);
  return static_cast<const TextModule*>(module)->text_outlines(text, style, warn);
}

}  // namespace bsp2::model
