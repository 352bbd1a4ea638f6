// The preset for inverters of an Orion BMS: 351h, 355h, 356h and 35Ah as with SMA, except the voltage of 356h in tenths
// of a volt, in captures of a pack of 292.5 V, and b4-5 of 355h in tenths of a percent. Little-endian, 500 kbit/s.
//
// In its DBC the current of 356h is positive out of the battery, in captures of other manufacturers into the battery;
// the pack file can invert it (`discharge_is_positive`). 35Bh has no row, as its layout is unknown. Everything in an
// Orion can be configured differently; 6B0h and its neighbours, 036h and 076h are not read: two vehicles of one team
// had two layouts of them.
#pragma once

#include "devices/device.hpp"
#include "devices/inverter_fields.hpp"

namespace bmu::orion {

inline constexpr SignalSpec charge_signals[] = {
    inverter::soc, inverter::soh,
    field::within(1, 1'000, field::little("soc_fine_permille", 4, 2, {Unit::permille}, inverter::no_u16_or_unfilled))};

inline constexpr MessageSpec limits =
    inverter::sent("ORION_LIMITS", 0x351, inverter::limit_signals, "voltages and currents the battery allows");
inline constexpr MessageSpec charge =
    inverter::sent("ORION_CHARGE", 0x355, charge_signals, "state of charge and health", 6);
inline constexpr MessageSpec measurements =
    inverter::sent("ORION_MEASURES", 0x356, inverter::coarse_measurement_signals,
                   "voltage in tenths, current, temperature of the battery", 6);
inline constexpr MessageSpec items =
    inverter::sent("ORION_ALARMS", 0x35A, inverter::item_signals, "alarms and warnings that came or went");
inline constexpr MessageSpec keep_alive =
    inverter::heard("ORION_ALIVE", 0x305, {}, "the inverter is there; no meaning of its bytes is known");

inline constexpr const MessageSpec* rows[] = {&limits, &charge, &measurements, &items, &keep_alive};
inline constexpr Catalogue catalogue{"orion", rows};

extern const InverterDriver driver;

inline constexpr Device device{.name = "orion",
                               .title = "inverter that understands the preset of an Orion BMS",
                               .kind = DeviceKind::inverter,
                               .catalogue = &catalogue,
                               .bit_rates = any_bit_rate,  // configurable in an Orion BMS
                               .meaning = "limits, state and alarms, in tenths of a volt and of a percent",
                               .inverter = &driver};

}  // namespace bmu::orion
