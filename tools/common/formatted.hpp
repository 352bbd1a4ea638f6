// Formatted numbers in a text, with the syntax of printf.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace bmu {

/// As printf; cut at 255 characters.
template <class... Values>
[[nodiscard]] std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace bmu
