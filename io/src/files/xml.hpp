#pragma once

#include <string>

namespace bsp2::io {

/// For an attribute of XML, or a text in it.
inline std::string quoted(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";  // in a text it may not follow ]]
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace bsp2::io
