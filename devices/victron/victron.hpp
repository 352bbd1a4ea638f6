// Victron's inverters, as documented by battery manufacturers: SMA's frames, and some more; little-endian, 500 kbit/s.
//
// No document of Victron was available. Of 370h to 379h only the content that several batteries send is defined here:
// in 372h and 379h the first two bytes. The temperatures of 373h are whole kelvins, and 0 C is taken as 273 K. The
// bytes of 305h, the inverter's keep-alive, have no known meaning. GX devices also send 307h, always with 12h 34h 56h
// 78h, "VIC" and 0: it is a keep-alive as well. Some batteries send temperatures and cell voltages under 370h, which
// then is no text.
#pragma once

#include "devices/device.hpp"
#include "devices/inverter_fields.hpp"

namespace bmu::victron {

inline constexpr SignalSpec module_signals[] = {field::little("module_count", 0, 2)};
inline constexpr SignalSpec extreme_signals[] = {
    field::little("cell_voltage_min_uV", 0, 2, field::cell_mV, inverter::no_u16),
    field::little("cell_voltage_max_uV", 2, 2, field::cell_mV, inverter::no_u16),
    field::little("cell_temperature_min_dC", 4, 2, field::degrees_from(-273), inverter::no_u16),
    field::little("cell_temperature_max_dC", 6, 2, field::degrees_from(-273), inverter::no_u16),
};
inline constexpr SignalSpec capacity_signals[] = {
    field::little("capacity_uAs", 0, 2, field::whole_Ah, inverter::no_u16)};

inline constexpr MessageSpec limits =
    inverter::sent("VICTRON_LIMITS", 0x351, inverter::limit_signals, "voltages and currents the battery allows");
inline constexpr MessageSpec charge =
    inverter::sent("VICTRON_CHARGE", 0x355, inverter::charge_signals, "state of charge and health", 6);
inline constexpr MessageSpec measurements = inverter::sent("VICTRON_MEASURES", 0x356, inverter::measurement_signals,
                                                           "voltage, current, temperature of the battery", 6);
inline constexpr MessageSpec items =
    inverter::sent("VICTRON_ALARMS", 0x35A, inverter::item_signals, "alarms and warnings that came or went");
inline constexpr MessageSpec maker =
    inverter::sent("VICTRON_MAKER", 0x35E, inverter::name_signals, "who made the battery");
inline constexpr MessageSpec name =
    inverter::sent("VICTRON_NAME", 0x370, inverter::name_signals, "what the battery is called");
inline constexpr MessageSpec modules =
    inverter::sent("VICTRON_MODULES", 0x372, module_signals, "how many modules there are", 2);
inline constexpr MessageSpec extremes =
    inverter::sent("VICTRON_EXTREMES", 0x373, extreme_signals, "lowest and highest cell, coldest and hottest");
inline constexpr MessageSpec capacity =
    inverter::sent("VICTRON_CAPACITY", 0x379, capacity_signals, "the capacity installed", 2);
inline constexpr MessageSpec keep_alive =
    inverter::heard("VICTRON_ALIVE", 0x305, {}, "the inverter is there; no meaning of its bytes is known");
inline constexpr MessageSpec gx_alive =
    inverter::heard("VICTRON_GX", 0x307, inverter::gx_signals, "a GX device is there");

inline constexpr const MessageSpec* rows[] = {&limits,  &charge,   &measurements, &items,      &maker,   &name,
                                              &modules, &extremes, &capacity,     &keep_alive, &gx_alive};
inline constexpr Catalogue catalogue{"victron", rows};

extern const InverterDriver driver;

/// A GX device has a profile of 250 kbit/s for a battery that shares the bus of Victron's own devices.
inline constexpr std::uint32_t bit_rates[] = {bit_rate_500k, bit_rate_250k};

inline constexpr Device device{.name = "victron",
                               .title = "Victron inverter (CAN-bus BMS)",
                               .kind = DeviceKind::inverter,
                               .catalogue = &catalogue,
                               .bit_rates = bit_rates,
                               .meaning = "limits, state, alarms, cells and capacity of a battery",
                               .inverter = &driver};

}  // namespace bmu::victron
