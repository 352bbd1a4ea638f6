// Quantities of this project, the units they are carried in, and the units they are displayed in.
//
// A value is an integer in the unit its name ends with (cell_voltage_max_uV), from the wire to the screen. A displayed
// value is scaled to the unit that technicians use; that scaling is defined here only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace bmu {

enum class Unit : std::uint8_t { none, uV, mV, mA, dC, Ohm, uOhm, uAs, mWh, permille, ppm, W, ms, s, mK_per_s, text };

struct UnitSpec {
  std::string_view token;   // suffix of every name that carries this unit
  std::string_view symbol;  // shown after the number
  std::int64_t divisor;     // carried counts per step of the last digit shown
  int decimals;             // digits shown after the point
};

/// One row per unit, in the order of the enumerators.
inline constexpr std::array<UnitSpec, 16> unit_table{{
    {"", "", 1, 0},
    {"uV", "V", 100, 4},  // on the bus: 0.1 mV
    {"mV", "V", 1, 3},
    {"mA", "A", 1, 3},
    {"dC", "C", 1, 1},
    {"Ohm", "kOhm", 1'000, 0},
    {"uOhm", "mOhm", 100, 1},
    {"uAs", "Ah", 360'000, 4},
    {"mWh", "kWh", 1'000, 3},
    {"permille", "%", 1, 1},
    {"ppm", "%", 100, 2},  // for values published in hundredths of a percent
    {"W", "W", 1, 0},
    {"ms", "ms", 1, 0},
    {"s", "s", 1, 0},
    {"mK_per_s", "K/s", 10, 2},
    {"", "", 1, 0},
}};

[[nodiscard]] constexpr const UnitSpec& spec_of(Unit unit) {
  return unit_table[static_cast<std::size_t>(unit)];
}

/// Division to the nearest integer, ties away from zero, of any value. divisor > 0.
[[nodiscard]] constexpr std::int64_t divide_to_nearest(std::int64_t value, std::int64_t divisor) {
  const std::int64_t quotient = value / divisor;
  const std::int64_t remainder = value % divisor;
  const std::int64_t distance = remainder < 0 ? -remainder : remainder;
  if (distance < divisor - distance) return quotient;
  return value < 0 ? quotient - 1 : quotient + 1;
}

inline constexpr std::int64_t uAs_per_Ah = 3'600'000'000;

[[nodiscard]] constexpr std::int32_t mV_from_uV(std::int64_t value_uV) {
  return static_cast<std::int32_t>(divide_to_nearest(value_uV, 1'000));
}
[[nodiscard]] constexpr std::int64_t uV_from_mV(std::int64_t value_mV) {
  return value_mV * 1'000;
}
[[nodiscard]] constexpr double V_from_uV(std::int64_t value_uV) {
  return static_cast<double>(value_uV) * 1e-6;
}
[[nodiscard]] constexpr double V_from_mV(std::int64_t value_mV) {
  return static_cast<double>(value_mV) * 1e-3;
}
[[nodiscard]] constexpr double A_from_mA(std::int64_t value_mA) {
  return static_cast<double>(value_mA) * 1e-3;
}
[[nodiscard]] constexpr double Ah_from_uAs(std::int64_t value_uAs) {
  return static_cast<double>(value_uAs) / static_cast<double>(uAs_per_Ah);
}

}  // namespace bmu
