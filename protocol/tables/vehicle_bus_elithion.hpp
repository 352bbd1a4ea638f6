// Traction-pack messages as Elithion's Lithiumate sends them (dialect "elithion"): received from a second pack, and
// sent if the pack file selects them (`vehicle/dialect`).
//
// Differences from `iha` (vehicle_bus.hpp): 622h consists of bits and codes in seven bytes; the sixth byte of 626h is
// always 0 and the second of 627h unused; its readers disagree whether 625h counts Wh or kWh, so it is counts here. The
// codes for "unknown", the sign of the current and the units of the resistances are taken from `iha`: other readers of
// these frames assume the same, a statement of the manufacturer is not available.
#pragma once

#include "protocol/tables/vehicle_bus.hpp"

namespace bmu::vehicle_bus_elithion {

inline constexpr RawName stored_fault_names[] = {{0, "none"},
                                                 {1, "driven while plugged in"},
                                                 {2, "interlock tripped"},
                                                 {3, "communication"},
                                                 {4, "charge overcurrent"},
                                                 {5, "discharge overcurrent"},
                                                 {6, "too hot"},
                                                 {7, "undervoltage"},
                                                 {8, "overvoltage"},
                                                 {9, "no battery voltage"},
                                                 {10, "leak from B-"},
                                                 {11, "leak from B+"},
                                                 {12, "K1 shorted"},
                                                 {13, "K2 shorted"},
                                                 {14, "K3 shorted"},
                                                 {15, "no precharge"},
                                                 {16, "K2 open"},
                                                 {17, "precharge too slow"},
                                                 {18, "memory overflow"},
                                                 {19, "front end silent"}};

/// Names of the bits of bit fields.
inline constexpr RawName fault_names[] = {
    {0x01, "driven while plugged in"}, {0x02, "interlock"}, {0x04, "communication"}, {0x08, "charge overcurrent"},
    {0x10, "discharge overcurrent"},   {0x20, "too hot"},   {0x40, "undervoltage"},  {0x80, "overvoltage"}};
inline constexpr RawName warning_names[] = {
    {0x01, "low voltage"}, {0x02, "high voltage"}, {0x04, "charge overcurrent"}, {0x08, "discharge overcurrent"},
    {0x10, "cold"},        {0x20, "hot"},          {0x40, "low health"},         {0x80, "isolation"}};

namespace detail {

consteval SignalSpec flag(std::string_view name, unsigned at, unsigned in_byte) {
  return {.name = name, .first_bit = bit(at, in_byte), .bit_count = 1};
}
consteval SignalSpec bits(std::string_view name, unsigned at, std::span<const RawName> names) {
  return {.name = name, .first_bit = byte(at), .bit_count = 8, .names = names};
}
consteval SignalSpec counts(std::string_view name, unsigned at) {
  return {.name = name, .first_bit = byte(at), .bit_count = 32, .special = vehicle_bus::unknown_u32};
}

}  // namespace detail

inline constexpr SignalSpec pack_status_signals[] = {
    detail::flag("fault", 0, 0),
    detail::flag("k1_on", 0, 1),
    detail::flag("k2_on", 0, 2),
    detail::flag("k3_on", 0, 3),
    detail::flag("relay_fault", 0, 4),
    {.name = "uptime_s", .first_bit = byte(1), .bit_count = 16, .unit = Unit::s},
    detail::flag("source_power", 3, 0),
    detail::flag("load_power", 3, 1),
    detail::flag("interlock_tripped", 3, 2),
    detail::flag("wired_request", 3, 3),
    detail::flag("can_request", 3, 4),
    detail::flag("charging_blocked", 3, 5),
    detail::flag("discharging_blocked", 3, 6),
    detail::flag("fan_on", 3, 7),
    {.name = "stored_fault", .first_bit = byte(4), .bit_count = 8, .names = stored_fault_names},
    detail::bits("fault_bits", 5, fault_names),
    detail::bits("warning_bits", 6, warning_names),
};
inline constexpr SignalSpec pack_energy_signals[] = {
    detail::counts("energy_in_counts", 0),
    detail::counts("energy_out_counts", 4),
};
inline constexpr SignalSpec pack_charge_signals[] = {
    vehicle_bus::detail::u8("soc_permille", 0, Unit::permille, 10, 100),
    vehicle_bus::detail::u16("depth_of_discharge_uAs", 1, Unit::uAs, uAs_per_Ah),
    vehicle_bus::detail::u16("capacity_uAs", 3, Unit::uAs, uAs_per_Ah),
    vehicle_bus::detail::u8("soh_permille", 6, Unit::permille, 10, 100),
};
inline constexpr SignalSpec pack_temperature_signals[] = {
    vehicle_bus::detail::s8("cell_temperature_average_dC", 0, Unit::dC, 10),
    vehicle_bus::detail::s8("cell_temperature_min_dC", 2, Unit::dC, 10),
    vehicle_bus::detail::u8("cell_temperature_min_sensor", 3, Unit::none, 1),
    vehicle_bus::detail::s8("cell_temperature_max_dC", 4, Unit::dC, 10),
    vehicle_bus::detail::u8("cell_temperature_max_sensor", 5, Unit::none, 1),
};

inline constexpr MessageSpec pack_status = vehicle_bus::detail::report(
    "PACK_STATUS", 2, 7, pack_status_signals, "contactors, seconds since start, inputs, faults, warnings");
inline constexpr MessageSpec pack_energy = vehicle_bus::detail::report(
    "PACK_ENERGY", 5, 8, pack_energy_signals, "energy in and out since manufacture, in Wh or kWh");
inline constexpr MessageSpec pack_charge =
    vehicle_bus::detail::report("PACK_CHARGE", 6, 7, pack_charge_signals, "state of charge and health, capacity");
inline constexpr MessageSpec pack_temperature = vehicle_bus::detail::report(
    "PACK_TEMPERATURE", 7, 6, pack_temperature_signals, "average, coldest and hottest sensor");

inline constexpr const MessageSpec* rows[] = {&vehicle_bus::pack_name,
                                              &vehicle_bus::pack_version,
                                              &pack_status,
                                              &vehicle_bus::pack_voltage,
                                              &vehicle_bus::pack_current,
                                              &pack_energy,
                                              &pack_charge,
                                              &pack_temperature,
                                              &vehicle_bus::pack_resistance};

inline constexpr Catalogue catalogue{"vehicle", rows};

static_assert(check_catalogue(catalogue));

}  // namespace bmu::vehicle_bus_elithion
