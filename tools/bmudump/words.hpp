// Numbers and failures in words, for what is printed once and not a million times a second.
#pragma once

#include <array>
#include <cstdio>
#include <string>

#include "tools/bmudump/statistics.hpp"

namespace bmu::dump {

/// As printf; cut at 255 characters.
template <class... Values>
[[nodiscard]] std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// "CELLS_1 node 3"; "unknown" without a message.
[[nodiscard]] std::string name_text(const MessageSpec* message, std::uint8_t node);
/// "wrong crc 2, late 1"; empty if none failed.
[[nodiscard]] std::string failures_text(const IdStatistics& row);

}  // namespace bmu::dump
