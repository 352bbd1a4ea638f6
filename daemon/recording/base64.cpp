#include "daemon/recording/base64.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace bmu {

namespace {

constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t no_digit = 0xff;

constexpr std::array<std::uint8_t, 256> values_by_character() {
  std::array<std::uint8_t, 256> table{};
  table.fill(no_digit);
  for (std::size_t value = 0; value < digits.size(); ++value) {
    table[static_cast<std::uint8_t>(digits[value])] = static_cast<std::uint8_t>(value);
  }
  return table;
}
constexpr std::array<std::uint8_t, 256> values = values_by_character();

/// Four digits as 24 bits. A digit has six; an invalid character has eight, which `seen` has from then on.
std::uint32_t group_of(const char* text, std::uint32_t& seen) {
  const auto value = [text](std::size_t at) { return std::uint32_t{values[static_cast<std::uint8_t>(text[at])]}; };
  const std::uint32_t first = value(0);
  const std::uint32_t second = value(1);
  const std::uint32_t third = value(2);
  const std::uint32_t fourth = value(3);
  seen |= first | second | third | fourth;
  return first << 18 | second << 12 | third << 6 | fourth;
}

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
  if (text.empty()) return true;
  const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
  std::array<char, 4> last{};
  text.copy(last.data(), last.size(), text.size() - last.size());
  std::fill(last.end() - static_cast<std::ptrdiff_t>(padding), last.end(), digits[0]);
  text.remove_suffix(last.size());

  const std::size_t before = to.size();
  to.resize(before + (text.size() / 4 + 1) * 3);
  std::uint8_t* out = to.data() + before;
  std::uint32_t seen = 0;
  const auto put = [&](std::uint32_t group) {
    *out++ = static_cast<std::uint8_t>(group >> 16);
    *out++ = static_cast<std::uint8_t>(group >> 8);
    *out++ = static_cast<std::uint8_t>(group);
  };
  for (std::size_t at = 0; at < text.size(); at += 4) put(group_of(text.data() + at, seen));
  put(group_of(last.data(), seen));
  to.resize(to.size() - padding);
  return seen < digits.size();
}

}  // namespace bmu
