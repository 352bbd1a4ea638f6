// Common definitions of the inverters with "351h to 35Fh": little-endian, 500 kbit/s, and these four frames.
//
// An unused field of a used frame is 8000h if it is signed and FFFFh if not. That is SMA's rule; the others state none,
// and none of these numbers is a possible value of theirs.
//
// Batteries differ in the steps of 355h and 356h. In captures b4-5 of 355h are hundredths of a percent with SMA, REC
// and Victron, tenths with Orion, and 0 = not filled with BYD, Discover and LG: a 0 there is never 0.00 %. The voltage
// of 356h is in hundredths of a volt with SMA, Victron, Pylontech, BYD and LG, and in tenths with Discover and Orion. A
// frame does not show which one it is: each protocol has rows of its own.
//
// The current of 356h is positive while the battery charges with BYD, LG, Pylontech and CAN-SMART, in captures at a
// known discharge; Orion's DBC has the opposite sign. The rows carry the sign on the wire; the sender must apply it.
#pragma once

#include "devices/fields.hpp"
#include "protocol/message.hpp"

namespace bmu::inverter {

inline constexpr SpecialCode no_s16[] = {{-0x8000, Validity::unknown}};
inline constexpr SpecialCode no_u16[] = {{0xFFFF, Validity::unknown}};
/// Codes of a field that some batteries leave at 0.
inline constexpr SpecialCode no_u16_or_unfilled[] = {{0xFFFF, Validity::unknown}, {0, Validity::not_fitted}};

inline constexpr SignalSpec charge_voltage_limit =
    field::as_limit(field::little("charge_voltage_limit_mV", 0, 2, field::tenth_of_V, no_u16));
inline constexpr SignalSpec charge_current_limit =
    field::as_limit(field::as_signed(field::little("charge_current_limit_mA", 2, 2, field::tenth_of_A, no_s16)));
inline constexpr SignalSpec discharge_current_limit =
    field::as_limit(field::as_signed(field::little("discharge_current_limit_mA", 4, 2, field::tenth_of_A, no_s16)));
inline constexpr SignalSpec discharge_voltage_limit =
    field::little("discharge_voltage_limit_mV", 6, 2, field::tenth_of_V, no_u16);

/// For a protocol without b6-7 in its document: some batteries fill it.
inline constexpr SignalSpec optional_discharge_voltage_limit =
    field::little("discharge_voltage_limit_mV", 6, 2, field::tenth_of_V, no_u16_or_unfilled);

inline constexpr SignalSpec limit_signals[] = {charge_voltage_limit, charge_current_limit, discharge_current_limit,
                                               discharge_voltage_limit};

inline constexpr SignalSpec soc = field::within(0, 100, field::little("soc_permille", 0, 2, field::percent, no_u16));
inline constexpr SignalSpec soh = field::within(0, 100, field::little("soh_permille", 2, 2, field::percent, no_u16));
inline constexpr SignalSpec soc_fine =
    field::within(1, 10'000, field::little("soc_fine_ppm", 4, 2, field::hundredth_of_percent, no_u16_or_unfilled));

inline constexpr SignalSpec charge_signals[] = {soc, soh, soc_fine};

inline constexpr SignalSpec measurement_signals[] = {
    field::as_signed(field::little("battery_voltage_mV", 0, 2, field::hundredth_of_V, no_s16)),
    field::as_signed(field::little("battery_current_mA", 2, 2, field::tenth_of_A, no_s16)),
    field::as_signed(field::little("battery_temperature_dC", 4, 2, field::tenth_of_C, no_s16)),
};

/// The same with tenths of a volt.
inline constexpr SignalSpec coarse_measurement_signals[] = {
    field::as_signed(field::little("battery_voltage_mV", 0, 2, field::tenth_of_V, no_s16)),
    measurement_signals[1],
    measurement_signals[2],
};

/// Items of 35Ah: each has two bits, which indicate that it was raised or cleared; the other two patterns have no
/// meaning. Batteries send AAh in all bytes (all cleared), or a mixture of 10b with 11b or 00b, while no alarm is
/// raised.
inline constexpr RawName item_names[] = {{0, "no change"}, {1, "raised"}, {2, "cleared"}, {3, "no change"}};

/// Alarms in b0 to b3, the same items as warnings in b4 to b7; the last three of each are not used.
inline constexpr SignalSpec item_signals[] = {
    field::bits("general_alarm", 0, 1, 2, item_names),
    field::bits("high_voltage_alarm", 0, 3, 2, item_names),
    field::bits("low_voltage_alarm", 0, 5, 2, item_names),
    field::bits("hot_alarm", 0, 7, 2, item_names),
    field::bits("cold_alarm", 1, 1, 2, item_names),
    field::bits("hot_to_charge_alarm", 1, 3, 2, item_names),
    field::bits("cold_to_charge_alarm", 1, 5, 2, item_names),
    field::bits("high_current_alarm", 1, 7, 2, item_names),
    field::bits("high_charge_current_alarm", 2, 1, 2, item_names),
    field::bits("contactor_alarm", 2, 3, 2, item_names),
    field::bits("short_circuit_alarm", 2, 5, 2, item_names),
    field::bits("internal_alarm", 2, 7, 2, item_names),
    field::bits("imbalance_alarm", 3, 1, 2, item_names),
    field::bits("general_warning", 4, 1, 2, item_names),
    field::bits("high_voltage_warning", 4, 3, 2, item_names),
    field::bits("low_voltage_warning", 4, 5, 2, item_names),
    field::bits("hot_warning", 4, 7, 2, item_names),
    field::bits("cold_warning", 5, 1, 2, item_names),
    field::bits("hot_to_charge_warning", 5, 3, 2, item_names),
    field::bits("cold_to_charge_warning", 5, 5, 2, item_names),
    field::bits("high_current_warning", 5, 7, 2, item_names),
    field::bits("high_charge_current_warning", 6, 1, 2, item_names),
    field::bits("contactor_warning", 6, 3, 2, item_names),
    field::bits("short_circuit_warning", 6, 5, 2, item_names),
    field::bits("internal_warning", 6, 7, 2, item_names),
    field::bits("imbalance_warning", 7, 1, 2, item_names),
};

/// Content of 307h, which GX devices send besides 305h.
inline constexpr std::int64_t gx_mark = 0x56'49'43;  // "VIC"
inline constexpr std::int64_t gx_number = 0x12'34'56'78;
inline constexpr SignalSpec gx_signals[] = {field::big("number", 0, 4),
                                            field::within(gx_mark, gx_mark, field::letters("mark", 4, 3))};

inline constexpr SignalSpec name_signals[] = {field::letters("name", 0, 8)};

[[nodiscard]] consteval MessageSpec sent(std::string_view name, std::uint32_t id, std::span<const SignalSpec> signals,
                                         std::string_view meaning, std::uint8_t length_min = 0) {
  return {.name = name,
          .base_id = id,
          .length = 8,
          .length_min = length_min,
          .sender = Sender::bmu,
          .period = 1s,
          .signals = signals,
          .meaning = meaning};
}
[[nodiscard]] consteval MessageSpec heard(std::string_view name, std::uint32_t id, std::span<const SignalSpec> signals,
                                          std::string_view meaning) {
  return {
      .name = name, .base_id = id, .sender = Sender::inverter, .period = 1s, .signals = signals, .meaning = meaning};
}

}  // namespace bmu::inverter
