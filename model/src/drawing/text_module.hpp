#pragma once

#include "drawing/text.hpp"

namespace bsp2::model {

/// What bsp2-text does.
struct TextModule {
  static constexpr const char* name = "bsp2-text";
  TextOutlines (*text_outlines)(const std::string& text, const TextStyle& style,
                                const std::function<void(std::string)>& warn);
};

}  // namespace bsp2::model
