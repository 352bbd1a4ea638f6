// Shorthand for the signals of third-party protocols; without it their rows would be mostly braces:
//
//   as_signed(field::little("battery_current_mA", 2, 2, field::tenth_of_A, codes))
//
// is a signed little-endian number in b2 and b3, in tenths of an ampere.
#pragma once

#include <span>
#include <string_view>

#include "protocol/signal.hpp"

namespace bmu::field {

using Codes = std::span<const SpecialCode>;

/// Unit of a field, and the values of one raw count and of raw 0.
struct Quantity {
  Unit unit = Unit::none;
  std::int64_t scale = 1;
  std::int64_t offset = 0;
};

inline constexpr Quantity whole_V{Unit::mV, 1'000};
inline constexpr Quantity tenth_of_V{Unit::mV, 100};
inline constexpr Quantity hundredth_of_V{Unit::mV, 10};
inline constexpr Quantity cell_mV{Unit::uV, 1'000};
inline constexpr Quantity whole_A{Unit::mA, 1'000};
inline constexpr Quantity tenth_of_A{Unit::mA, 100};
inline constexpr Quantity hundredth_of_A{Unit::mA, 10};
inline constexpr Quantity tenth_of_C{Unit::dC, 1};
inline constexpr Quantity percent{Unit::permille, 10};
inline constexpr Quantity hundredth_of_percent{Unit::ppm, 100};
inline constexpr Quantity whole_Ah{Unit::uAs, uAs_per_Ah};
inline constexpr Quantity hundredth_of_Ah{Unit::uAs, uAs_per_Ah / 100};
inline constexpr Quantity kOhm{Unit::Ohm, 1'000};
inline constexpr Quantity whole_ms{Unit::ms, 1};

/// Whole degrees; raw 0 is `zero_C`.
[[nodiscard]] consteval Quantity degrees_from(std::int64_t zero_C) {
  return {Unit::dC, 10, zero_C * 10};
}

/// A number of whole bytes, the first one highest.
[[nodiscard]] consteval SignalSpec big(std::string_view name, unsigned first_byte, unsigned count, Quantity what = {},
                                       Codes special = {}) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(first_byte * 8),
          .bit_count = static_cast<std::uint8_t>(count * 8),
          .unit = what.unit,
          .scale = what.scale,
          .offset = what.offset,
          .special = special};
}
/// The same, the first one lowest.
[[nodiscard]] consteval SignalSpec little(std::string_view name, unsigned first_byte, unsigned count,
                                          Quantity what = {}, Codes special = {}) {
  SignalSpec signal = big(name, first_byte, count, what, special);
  signal.order = ByteOrder::little;
  return signal;
}
/// A number of one byte.
[[nodiscard]] consteval SignalSpec u8(std::string_view name, unsigned at, Quantity what = {}, Codes special = {}) {
  return big(name, at, 1, what, special);
}
[[nodiscard]] consteval SignalSpec letters(std::string_view name, unsigned first_byte, unsigned count) {
  return big(name, first_byte, count, {Unit::text});
}
[[nodiscard]] consteval SignalSpec flag(std::string_view name, unsigned at, unsigned in_byte) {
  return {.name = name, .first_bit = static_cast<std::uint8_t>(at * 8 + (7 - in_byte)), .bit_count = 1};
}
/// `count` bits of a byte, from `highest` downwards.
[[nodiscard]] consteval SignalSpec bits(std::string_view name, unsigned at, unsigned highest, unsigned count,
                                        std::span<const RawName> names = {}) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(at * 8 + (7 - highest)),
          .bit_count = static_cast<std::uint8_t>(count),
          .names = names};
}

[[nodiscard]] consteval SignalSpec as_signed(SignalSpec signal) {
  signal.is_signed = true;
  return signal;
}
/// Rounded so that a sent limit never exceeds the available one.
[[nodiscard]] consteval SignalSpec as_limit(SignalSpec signal) {
  signal.rounding = Rounding::towards_zero;
  return signal;
}
[[nodiscard]] consteval SignalSpec named(SignalSpec signal, std::span<const RawName> names) {
  signal.names = names;
  return signal;
}
[[nodiscard]] consteval SignalSpec within(std::int64_t raw_min, std::int64_t raw_max, SignalSpec signal) {
  signal.documented = {raw_min, raw_max};
  return signal;
}
/// Exists while the selector is `first`, or one of `count` values at a distance of `step`.
[[nodiscard]] consteval SignalSpec when(unsigned first, SignalSpec signal, unsigned count = 1, unsigned step = 1) {
  signal.selected_by = static_cast<std::int16_t>(first);
  signal.selected_count = static_cast<std::uint8_t>(count);
  signal.selected_step = static_cast<std::uint8_t>(step);
  return signal;
}

}  // namespace bmu::field
