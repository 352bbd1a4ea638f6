// SMA's battery inverters (Sunny Island and the like): little-endian, 500 kbit/s.
//
// Frames must be at least 200 ms apart (another document requires 100 ms, contrary to SMA's own). If 355h is missing
// for 60 s, the inverter goes to standby with F952; if 351h is missing for as long, it warns with W952. An alarm makes
// it stop, which may take 10 s: keep the contactors closed that long, if that is safe.
//
// According to SMA the third number of 35Fh is the installed capacity, which this driver sends; batteries of BYD and
// Pytes send the remaining charge there: 105 Ah at 67 % of 156 Ah. The frame does not show which of the two it is.
//
// 35Bh (events) is named in the documents, but its layout is unknown: there is no row for it. The types of voltage and
// temperature in 305h are not documented; they are read as those of 356h. In 306h only the order is documented; the
// widths here fill eight bytes.
#pragma once

#include "devices/device.hpp"
#include "devices/inverter_fields.hpp"

namespace bmu::sma {

/// Frames that are sent more often are too many for the inverter.
inline constexpr Duration period_min = 200ms;
/// The inverter gives up after this time without state of charge or limits.
inline constexpr Duration battery_life = 60s;

enum class State : std::uint8_t { idle = 0, operating = 1, warning = 3, failure = 4 };
inline constexpr RawName inverter_state_names[] = {{0, "idle"}, {1, "operating"}, {3, "warning"}, {4, "failure"}};

/// The only number between the documented ones without a meaning.
inline constexpr SpecialCode inverter_state_codes[] = {{2, Validity::out_of_range}};

inline constexpr SignalSpec battery_signals[] = {
    field::little("battery_type", 0, 2, {}, inverter::no_u16),
    field::little("bms_version", 2, 2, {}, inverter::no_u16),
    field::little("capacity_or_charge_left_uAs", 4, 2, field::whole_Ah, inverter::no_u16),
    field::little("manufacturer_id", 6, 2, {}, inverter::no_u16),
};
inline constexpr SignalSpec inverter_signals[] = {
    field::as_signed(field::little("battery_voltage_mV", 0, 2, field::tenth_of_V, inverter::no_s16)),
    field::as_signed(field::little("battery_current_mA", 2, 2, field::tenth_of_A, inverter::no_s16)),
    field::as_signed(field::little("battery_temperature_dC", 4, 2, field::tenth_of_C, inverter::no_s16)),
    field::within(0, 1'000, field::little("soc_permille", 6, 2, {Unit::permille}, inverter::no_u16)),
};
inline constexpr SignalSpec inverter_state_signals[] = {
    field::within(0, 100, field::little("soh_permille", 0, 2, field::percent, inverter::no_u16)),
    field::u8("charge_procedure", 2),
    field::within(0, 4, field::named(field::u8("state", 3, {}, inverter_state_codes), inverter_state_names)),
    field::little("error_number", 4, 2, {}, inverter::no_u16),
    field::little("charge_voltage_wanted_mV", 6, 2, field::tenth_of_V, inverter::no_u16),
};

inline constexpr MessageSpec limits =
    inverter::sent("SMA_LIMITS", 0x351, inverter::limit_signals, "voltages and currents the battery allows");
inline constexpr MessageSpec charge =
    inverter::sent("SMA_CHARGE", 0x355, inverter::charge_signals, "state of charge and health", 6);
inline constexpr MessageSpec measurements = inverter::sent("SMA_MEASUREMENTS", 0x356, inverter::measurement_signals,
                                                           "voltage, current, temperature of the battery", 6);
inline constexpr MessageSpec items =
    inverter::sent("SMA_ALARMS", 0x35A, inverter::item_signals, "alarms and warnings that came or went");
inline constexpr MessageSpec name = inverter::sent("SMA_NAME", 0x35E, inverter::name_signals, "who made the battery");
inline constexpr MessageSpec battery =
    inverter::sent("SMA_BATTERY", 0x35F, battery_signals,
                   "type and version of the battery; its capacity, or of some makers the charge that is left");
inline constexpr MessageSpec standby{.name = "SMA_STANDBY",
                                     .base_id = 0x00F,
                                     .length = 0,
                                     .sender = Sender::bmu,
                                     .meaning = "the inverter is to go to standby at once; it has no data"};
inline constexpr MessageSpec inverter_values =
    inverter::heard("SMA_INVERTER", 0x305, inverter_signals,
                    "the battery as the inverter measures it; its current is negative while it charges");
inline constexpr MessageSpec inverter_state = inverter::heard("SMA_INVERTER_STATE", 0x306, inverter_state_signals,
                                                              "what the inverter does, and the voltage it charges to");

inline constexpr const MessageSpec* rows[] = {&limits,  &charge,  &measurements,    &items,         &name,
                                              &battery, &standby, &inverter_values, &inverter_state};
inline constexpr Catalogue catalogue{"sma", rows};

extern const InverterDriver driver;

inline constexpr Device device{.name = "sma",
                               .title = "SMA battery inverter (Sunny Island)",
                               .kind = DeviceKind::inverter,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "limits, state and alarms of a battery, and what the inverter answers",
                               .inverter = &driver};

}  // namespace bmu::sma
