// The text styles, and the terminal's codes for them.
#pragma once

#include <cstdint>
#include <string_view>

namespace bmu {

enum class Style : std::uint8_t { normal, dim, strong, good, warning, bad, active, title };

[[nodiscard]] constexpr std::string_view escape_code(Style style) {
  switch (style) {
    case Style::normal: return "\033[0m";
    case Style::dim: return "\033[0;2m";
    case Style::strong: return "\033[0;1m";
    case Style::good: return "\033[0;32m";
    case Style::warning: return "\033[0;33m";
    case Style::bad: return "\033[0;1;31m";
    case Style::active: return "\033[0;36m";
    case Style::title: return "\033[0;7m";
  }
  return "";
}

}  // namespace bmu
