#include "daemon/recording/base64.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace bmu {

namespace {

constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t no_digit = 0xff;

constexpr std::array<std::uint8_t, 256> values = [] {
  std::array<std::uint8_t, 256> table{};
  table.fill(no_digit);
  for (std::size_t value = 0; value < digits.size(); ++value) {
    table[static_cast<std::uint8_t>(digits[value])] = static_cast<std::uint8_t>(value);
  }
  return table;
}();

}  // namespace

std::string to_base64(std::span<const std::uint8_t> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t index = 0; index < 3; ++index) group = (group << 8) | (index < count ? bytes[at + index] : 0U);
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += digit <= count ? digits[(group >> (18 - 6 * digit)) & 0x3fU] : '=';
    }
  }
  return text;
}

bool append_base64(std::string_view text, std::vector<std::uint8_t>& to) {
  if (text.size() % 4 != 0) return false;
  for (std::size_t at = 0; at < text.size(); at += 4) {
    const bool is_last = at + 4 == text.size();
    std::size_t count = 3;
    if (is_last && text[at + 3] == '=') count = text[at + 2] == '=' ? 1 : 2;
    std::uint32_t group = 0;
    for (std::size_t digit = 0; digit < 4; ++digit) {
      const std::uint8_t value = digit <= count ? values[static_cast<std::uint8_t>(text[at + digit])] : 0;
      if (value == no_digit) return false;
      group = (group << 6) | value;
    }
    for (std::size_t index = 0; index < count; ++index) {
      to.push_back(static_cast<std::uint8_t>(group >> (16 - 8 * index)));
    }
  }
  return true;
}

}  // namespace bmu
