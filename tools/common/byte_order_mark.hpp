// The byte-order mark that some editors put before a text: three bytes that do not belong to it.
#pragma once

#include <string_view>

namespace bmu {

inline constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

/// The text without the marks before it; there are several if a marked text was marked again.
[[nodiscard]] constexpr std::string_view without_byte_order_mark(std::string_view text) {
  while (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  return text;
}

}  // namespace bmu
