// The packet error code of the measuring chip (LTC6811 and relatives): 15 bits over the bytes of a register group,
// polynomial x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, start value 16, sent as two bytes with the lowest bit 0.
// It is the polynomial of classic CAN: in a group of 64 bits up to five wrong ones are always found, and every burst of
// up to 15. Source: LTC6811 data sheet, "Packet Error Code".
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace bmu {

namespace pec15_detail {

inline constexpr std::uint32_t polynomial = 0x4599;  // without x^15
inline constexpr std::uint32_t mask = 0x7FFF;

[[nodiscard]] constexpr std::array<std::uint16_t, 256> make_table() {
  std::array<std::uint16_t, 256> table{};
  for (std::uint32_t byte = 0; byte < table.size(); ++byte) {
    std::uint32_t remainder = byte << 7;
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder & 0x4000U) != 0 ? (remainder << 1) ^ polynomial : remainder << 1;
    }
    table[byte] = static_cast<std::uint16_t>(remainder & mask);
  }
  return table;
}
inline constexpr std::array<std::uint16_t, 256> table = make_table();

}  // namespace pec15_detail

/// As sent: the code shifted left by one. One table look-up per byte.
[[nodiscard]] constexpr std::uint16_t pec15(std::span<const std::uint8_t> bytes) {
  std::uint32_t remainder = 16;
  for (const std::uint8_t byte : bytes) {
    const std::uint32_t index = ((remainder >> 7) ^ byte) & 0xFFU;
    remainder = ((remainder << 8) ^ pec15_detail::table[index]) & pec15_detail::mask;
  }
  return static_cast<std::uint16_t>(remainder << 1);
}

// Published values: the commands to write and to read the configuration.
static_assert(pec15(std::array<std::uint8_t, 2>{0x00, 0x01}) == 0x3D6E);
static_assert(pec15(std::array<std::uint8_t, 2>{0x00, 0x02}) == 0x2B0A);
static_assert(pec15(std::span<const std::uint8_t>{}) == 0x0020, "nothing leaves the start value");

}  // namespace bmu
