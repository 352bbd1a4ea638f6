// Traction-pack messages as their first page defines them (dialect "original").
//
// Differences from `iha` (vehicle_bus.hpp): the state in 622h has a number for each of its states, those from 8 on
// while plugged in. No source defines the bits of the flags: they are sent as 0 and not read. The page prints a length
// of 6 for 626h and lists fields of 7 bytes: 7 are sent. 629h and 62Ah, of an AC line, are not sent: no source gives
// the unit of their numbers, and packs of this project have no AC line.
#pragma once

#include "protocol/tables/vehicle_bus.hpp"

namespace bmu::vehicle_bus_original {

inline constexpr RawName state_names[] = {{0, "unplugged, vehicle off"},
                                          {1, "unplugged, vehicle off, charging"},
                                          {2, "unplugged, vehicle on, contactors open"},
                                          {3, "unplugged, vehicle on, charge sustained"},
                                          {4, "unplugged, vehicle on, charge depleted"},
                                          {8, "plugged in, idle"},
                                          {9, "plugged in, about to charge"},
                                          {10, "plugged in, charging"},
                                          {11, "plugged in, about to discharge"},
                                          {12, "plugged in, discharging to the grid"},
                                          {13, "plugged in, discharging to the home"}};

/// Numbers between the named states, which the page does not define.
inline constexpr SpecialCode reserved_states[] = {
    {5, Validity::out_of_range}, {6, Validity::out_of_range}, {7, Validity::out_of_range}};

/// Trouble codes are manufacturer-specific: those of `iha` are used.
inline constexpr SignalSpec pack_status_signals[] = {
    {.name = "state",
     .first_bit = byte(0),
     .bit_count = 8,
     .special = reserved_states,
     .names = state_names,
     .documented = {0, 13}},
    {.name = "uptime_s", .first_bit = byte(1), .bit_count = 16, .unit = Unit::s},
    {.name = "dtc_1", .first_bit = byte(4), .bit_count = 8, .names = vehicle_bus::dtc_names},
    {.name = "dtc_2", .first_bit = byte(5), .bit_count = 8, .names = vehicle_bus::dtc_names},
};
inline constexpr MessageSpec pack_status =
    vehicle_bus::detail::report("PACK_STATUS", 2, 6, pack_status_signals, "state, seconds since start, trouble codes");

inline constexpr const MessageSpec* rows[] = {
    &vehicle_bus::pack_name,    &vehicle_bus::pack_version,     &pack_status,
    &vehicle_bus::pack_voltage, &vehicle_bus::pack_current,     &vehicle_bus::pack_energy,
    &vehicle_bus::pack_charge,  &vehicle_bus::pack_temperature, &vehicle_bus::pack_resistance};

inline constexpr Catalogue catalogue{"vehicle", rows};

static_assert(check_catalogue(catalogue));

}  // namespace bmu::vehicle_bus_original
