// Classic CAN frame as the pure parts use it: the kernel's can_frame without its flag bits in the identifier.
#pragma once

#include <array>
#include <compare>
#include <cstdint>

namespace bmu {

struct CanFrame {
  std::uint32_t id = 0;  // 11 bits, or 29 when is_extended
  bool is_extended = false;
  bool is_remote = false;
  bool is_error = false;    // an error frame of the controller; id then holds the kernel's error class bits
  std::uint8_t length = 0;  // 0 to 8
  std::array<std::uint8_t, 8> data{};

  friend constexpr bool operator==(const CanFrame&, const CanFrame&) = default;
};

/// The usual frame of this project: 11-bit identifier, data.
[[nodiscard]] constexpr CanFrame data_frame(std::uint32_t id, std::uint8_t length) {
  return CanFrame{.id = id, .length = length};
}

}  // namespace bmu
