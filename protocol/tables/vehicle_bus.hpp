// The vehicle bus: traction-pack messages 620h to 628h, in the dialect of the 2013 competition design ("iha").
//
// Each message is sent once a second, 10 ms after the previous one. Unknown is FFh, FFFFh, 80h or 8000h by the field's
// type, never 0; for the 32-bit energies no source gives a code and FFFFFFFFh is used by analogy.
#pragma once

#include "protocol/message.hpp"

namespace bmu::vehicle_bus {

inline constexpr std::uint16_t default_base_id = 0x620;

inline constexpr SpecialCode unknown_u8[] = {{0xFF, Validity::unknown}};
inline constexpr SpecialCode unknown_u16[] = {{0xFFFF, Validity::unknown}};
inline constexpr SpecialCode unknown_u32[] = {{0xFFFF'FFFF, Validity::unknown}};
inline constexpr SpecialCode unknown_s8[] = {{-0x80, Validity::unknown}};
inline constexpr SpecialCode unknown_s16[] = {{-0x8000, Validity::unknown}};

/// State of the `iha` dialect. There is no code for "vehicle on, contactors still open": it is sent as `off_open`,
/// because people act on the state of the contactors.
enum class State : std::uint8_t { fault = 0, charger_closed = 1, on_closed = 2, off_closed = 3, off_open = 4 };
inline constexpr RawName state_names[] = {{0, "fault"},
                                          {1, "charger connected, contactors closed"},
                                          {2, "vehicle on, contactors closed"},
                                          {3, "vehicle off, contactors closed"},
                                          {4, "contactors open"}};
inline constexpr RawName dtc_names[] = {{0, "none"}, {1, "poor cell"}, {2, "poor battery"}, {3, "too cold to charge"}};

namespace detail {

consteval SignalSpec u8(std::string_view name, unsigned at, Unit unit, std::int64_t scale, std::int64_t raw_limit = 0) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(at * 8),
          .bit_count = 8,
          .unit = unit,
          .scale = scale,
          .special = unknown_u8,
          .raw_limit = raw_limit};
}
consteval SignalSpec s8(std::string_view name, unsigned at, Unit unit, std::int64_t scale) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(at * 8),
          .bit_count = 8,
          .unit = unit,
          .scale = scale,
          .is_signed = true,
          .special = unknown_s8};
}
consteval SignalSpec u16(std::string_view name, unsigned at, Unit unit, std::int64_t scale) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(at * 8),
          .bit_count = 16,
          .unit = unit,
          .scale = scale,
          .special = unknown_u16};
}
consteval SignalSpec limit(std::string_view name, unsigned at) {
  SignalSpec signal = u16(name, at, Unit::mA, 1'000);
  signal.rounding = Rounding::towards_zero;
  signal.raw_limit = 32'000;
  return signal;
}
consteval SignalSpec u32(std::string_view name, unsigned at, Unit unit, std::int64_t scale) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(at * 8),
          .bit_count = 32,
          .unit = unit,
          .scale = scale,
          .special = unknown_u32};
}
consteval MessageSpec report(std::string_view name, unsigned index, std::uint8_t length,
                             std::span<const SignalSpec> signals, std::string_view meaning) {
  return {.name = name,
          .base_id = static_cast<std::uint16_t>(default_base_id + index),
          .length = length,
          .sender = Sender::bmu,
          .period = 1s,
          .signals = signals,
          .meaning = meaning};
}

}  // namespace detail

inline constexpr SignalSpec pack_name_signals[] = {
    {.name = "name", .first_bit = byte(0), .bit_count = 64, .unit = Unit::text}};
inline constexpr SignalSpec pack_version_signals[] = {
    {.name = "version", .first_bit = byte(0), .bit_count = 64, .unit = Unit::text}};
inline constexpr SignalSpec pack_status_signals[] = {
    {.name = "state", .first_bit = byte(0), .bit_count = 8, .names = state_names, .documented = {0, 4}},
    {.name = "uptime_s", .first_bit = byte(1), .bit_count = 16, .unit = Unit::s},
    {.name = "discharging", .first_bit = bit(3, 2), .bit_count = 1},
    {.name = "charging", .first_bit = bit(3, 1), .bit_count = 1},
    {.name = "dtc_1", .first_bit = byte(4), .bit_count = 8, .names = dtc_names},
    {.name = "dtc_2", .first_bit = byte(5), .bit_count = 8, .names = dtc_names},
};
inline constexpr SignalSpec pack_voltage_signals[] = {
    detail::u16("pack_voltage_mV", 0, Unit::mV, 1'000),    detail::u8("cell_voltage_min_uV", 2, Unit::uV, 100'000),
    detail::u8("cell_voltage_min_cell", 3, Unit::none, 1), detail::u8("cell_voltage_max_uV", 4, Unit::uV, 100'000),
    detail::u8("cell_voltage_max_cell", 5, Unit::none, 1),
};
inline constexpr SignalSpec pack_current_signals[] = {
    {.name = "pack_current_mA",
     .first_bit = byte(0),
     .bit_count = 16,
     .unit = Unit::mA,
     .scale = 1'000,
     .is_signed = true,
     .special = unknown_s16,
     .raw_limit = 32'000},
    detail::limit("charge_limit_mA", 2),
    detail::limit("discharge_limit_mA", 4),
};
inline constexpr SignalSpec pack_energy_signals[] = {
    detail::u32("energy_in_mWh", 0, Unit::mWh, 1'000),
    detail::u32("energy_out_mWh", 4, Unit::mWh, 1'000),
};
inline constexpr SignalSpec pack_charge_signals[] = {
    detail::u8("soc_permille", 0, Unit::permille, 10, 100),
    detail::u16("depth_of_discharge_uAs", 1, Unit::uAs, uAs_per_Ah),
    detail::u16("capacity_uAs", 3, Unit::uAs, uAs_per_Ah),
    detail::u8("soc_2_permille", 5, Unit::permille, 10, 100),
    detail::u8("soh_permille", 6, Unit::permille, 10, 100),
};
inline constexpr SignalSpec pack_temperature_signals[] = {
    detail::s8("cell_temperature_average_dC", 0, Unit::dC, 10),
    detail::s8("air_temperature_dC", 1, Unit::dC, 10),
    detail::s8("cell_temperature_min_dC", 2, Unit::dC, 10),
    detail::u8("cell_temperature_min_sensor", 3, Unit::none, 1),
    detail::s8("cell_temperature_max_dC", 4, Unit::dC, 10),
    detail::u8("cell_temperature_max_sensor", 5, Unit::none, 1),
};
inline constexpr SignalSpec pack_resistance_signals[] = {
    detail::u16("pack_resistance_uOhm", 0, Unit::uOhm, 1'000),
    detail::u8("cell_resistance_min_uOhm", 2, Unit::uOhm, 100),
    detail::u8("cell_resistance_min_cell", 3, Unit::none, 1),
    detail::u8("cell_resistance_max_uOhm", 4, Unit::uOhm, 100),
    detail::u8("cell_resistance_max_cell", 5, Unit::none, 1),
};

inline constexpr MessageSpec pack_name =
    detail::report("PACK_NAME", 0, 8, pack_name_signals, "who made it, 8 characters");
inline constexpr MessageSpec pack_version =
    detail::report("PACK_VERSION", 1, 8, pack_version_signals, "its version, 8 characters");
inline constexpr MessageSpec pack_status =
    detail::report("PACK_STATUS", 2, 6, pack_status_signals, "state, seconds since start, trouble codes");
inline constexpr MessageSpec pack_voltage =
    detail::report("PACK_VOLTAGE", 3, 6, pack_voltage_signals, "pack voltage, lowest and highest cell");
inline constexpr MessageSpec pack_current =
    detail::report("PACK_CURRENT", 4, 6, pack_current_signals, "current (positive = discharge) and limits");
inline constexpr MessageSpec pack_energy =
    detail::report("PACK_ENERGY", 5, 8, pack_energy_signals, "energy in and out since manufacture");
inline constexpr MessageSpec pack_charge =
    detail::report("PACK_CHARGE", 6, 7, pack_charge_signals, "state of charge and health, capacity");
inline constexpr MessageSpec pack_temperature =
    detail::report("PACK_TEMPERATURE", 7, 6, pack_temperature_signals, "average, air, coldest and hottest sensor");
inline constexpr MessageSpec pack_resistance =
    detail::report("PACK_RESISTANCE", 8, 6, pack_resistance_signals, "resistance of pack, best and worst cell");

inline constexpr const MessageSpec* rows[] = {&pack_name,    &pack_version,     &pack_status,
                                              &pack_voltage, &pack_current,     &pack_energy,
                                              &pack_charge,  &pack_temperature, &pack_resistance};

inline constexpr Catalogue catalogue{"vehicle", rows};

static_assert(check_catalogue(catalogue));

}  // namespace bmu::vehicle_bus
