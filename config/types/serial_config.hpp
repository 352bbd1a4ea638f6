// Settings of the serial console: terminal device, bit rate, and whether it may set the number of cells.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

namespace bmu {

struct SerialConfig {
  std::string device;  // "/dev/ttyUSB0"; empty: no console
  std::int32_t bit_rate_Bd = 38'400;
  bool may_set_cell_count = false;
  std::uint8_t modules_max = 1;  // that CellC may spread the cells over
};

/// Bit rates that every adapter supports.
inline constexpr std::array<std::int32_t, 8> serial_rates_Bd{1'200,  2'400,  4'800,  9'600,
                                                             19'200, 38'400, 57'600, 115'200};

[[nodiscard]] constexpr bool is_serial_rate(std::int32_t bit_rate_Bd) {
  return std::find(serial_rates_Bd.begin(), serial_rates_Bd.end(), bit_rate_Bd) != serial_rates_Bd.end();
}

}  // namespace bmu
