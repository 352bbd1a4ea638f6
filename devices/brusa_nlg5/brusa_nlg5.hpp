// Brusa NLG5 charger: 11-bit identifiers, big-endian, 500 kbit/s.
//
// The charger requires a control message every 100 ms, with valid numbers in all three set-points; after 300 ms without
// one it stops with an error. Latched errors are cleared by `clear_errors` going from 0 to 1 and back to 0, except
// those that only switching it off clears (output overvoltage, power stage shorted, wrong polarity, the emergency
// thresholds).
//
// `mains_request` makes it request mains from a charging post, by state C of the control pilot (IEC 61851). Only one
// source has the bit, and none states whether a charger at a post needs it or requests mains by itself: it is set if
// the pack file enables it (charger/requests_mains), and only while the pack is being charged.
//
// Unknown: which of the two bits of the bypass detection leads (none, DC, AC in phase, AC not in phase), so they are
// two flags here; the identifiers of a second charger (one source gives 638h for its control message).
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::brusa_nlg5 {

/// The charger stops after this time without a control message.
inline constexpr Duration control_life = 300ms;

inline constexpr RawName limit_names[] = {{0x20, "output voltage"},  {0x10, "output current"}, {0x08, "mains current"},
                                          {0x04, "power indicator"}, {0x02, "control pilot"},  {0x01, "maximum power"}};
inline constexpr RawName capability_names[] = {
    {0x80, "mains current capability"},      {0x40, "output current capability"}, {0x20, "output voltage capability"},
    {0x10, "primary capacitor temperature"}, {0x08, "power stage temperature"},   {0x04, "diode temperature"},
    {0x02, "transformer temperature"},       {0x01, "battery temperature"}};
inline constexpr RawName power_error_names[] = {{0x80, "output overvoltage"},
                                                {0x40, "mains overvoltage 2"},
                                                {0x20, "mains overvoltage 1"},
                                                {0x10, "power stage short"},
                                                {0x08, "output voltage implausible"},
                                                {0x04, "mains voltage implausible"},
                                                {0x02, "output fuse"},
                                                {0x01, "mains fuse"}};
inline constexpr RawName sensor_error_names[] = {{0x80, "wrong battery polarity"}, {0x40, "primary capacitor sensor"},
                                                 {0x20, "power stage sensor"},     {0x10, "diode sensor"},
                                                 {0x08, "transformer sensor"},     {0x04, "external sensor 1"},
                                                 {0x02, "external sensor 2"},      {0x01, "external sensor 3"}};
inline constexpr RawName control_error_names[] = {{0x80, "flash checksum"},
                                                  {0x40, "settings checksum"},
                                                  {0x20, "system EEPROM checksum"},
                                                  {0x10, "power EEPROM checksum"},
                                                  {0x08, "watchdog"},
                                                  {0x04, "initialisation"},
                                                  {0x02, "no control message"},
                                                  {0x01, "CAN off"}};
inline constexpr RawName emergency_names[] = {{0x20, "transmit buffer full"}, {0x10, "receive buffer full"},
                                              {0x08, "battery temperature"},  {0x04, "battery voltage"},
                                              {0x02, "battery charge"},       {0x01, "charging time"}};
inline constexpr RawName warning_names[] = {{0x10, "mains voltage low"},
                                            {0x08, "battery voltage low"},
                                            {0x04, "charger hot"},
                                            {0x02, "command out of range"},
                                            {0x01, "control message not active"}};

inline constexpr SignalSpec control_signals[] = {
    field::flag("enable", 0, 7),
    field::flag("clear_errors", 0, 6),
    field::flag("ventilation_request", 0, 5),
    field::flag("mains_request", 0, 4),
    field::as_limit(field::big("mains_current_limit_mA", 1, 2, field::tenth_of_A)),
    field::as_limit(field::big("output_voltage_limit_mV", 3, 2, field::tenth_of_V)),
    field::as_limit(field::big("output_current_limit_mA", 5, 2, field::tenth_of_A)),
};
inline constexpr SignalSpec status_signals[] = {
    field::flag("enable_input", 0, 7),
    field::flag("error", 0, 6),
    field::flag("warning", 0, 5),
    field::flag("fan_on", 0, 4),
    field::flag("mains_eu", 0, 3),
    field::flag("mains_us_120", 0, 2),
    field::flag("mains_us_240", 0, 1),
    field::flag("control_pilot_seen", 0, 0),
    field::flag("bypass_1", 1, 7),
    field::flag("bypass_2", 1, 6),
    field::bits("limited_by_bits", 1, 5, 6, limit_names),
    field::bits("capability_bits", 2, 7, 8, capability_names),
    field::flag("auxiliary_charging", 3, 0),
};
inline constexpr SignalSpec actual_1_signals[] = {
    field::big("mains_current_mA", 0, 2, field::hundredth_of_A),
    field::big("mains_voltage_mV", 2, 2, field::tenth_of_V),
    field::within(0, charger_output_raw_max, field::big("output_voltage_mV", 4, 2, field::tenth_of_V)),
    field::as_signed(field::big("output_current_mA", 6, 2, field::hundredth_of_A)),
};
inline constexpr SignalSpec actual_2_signals[] = {
    field::big("pilot_current_limit_mA", 0, 2, field::tenth_of_A),
    field::u8("indicator_current_limit_mA", 2, field::tenth_of_A),
    field::u8("auxiliary_voltage_mV", 3, field::tenth_of_V),
    field::as_signed(field::big("charge_counter_uAs", 4, 2, field::hundredth_of_Ah)),
    field::big("booster_current_mA", 6, 2, field::hundredth_of_A),
};
namespace detail {

/// From -50 to 200 C: bounds chosen by this program, as no source gives any.
consteval SignalSpec temperature(std::string_view name, unsigned first_byte) {
  return field::within(-500, 2'000, field::as_signed(field::big(name, first_byte, 2, field::tenth_of_C)));
}

}  // namespace detail

inline constexpr SignalSpec temperature_signals[] = {
    detail::temperature("power_stage_temperature_dC", 0),
    detail::temperature("external_temperature_1_dC", 2),
    detail::temperature("external_temperature_2_dC", 4),
    detail::temperature("external_temperature_3_dC", 6),
};
inline constexpr SignalSpec error_signals[] = {
    field::bits("power_error_bits", 0, 7, 8, power_error_names),
    field::bits("sensor_error_bits", 1, 7, 8, sensor_error_names),
    field::bits("control_error_bits", 2, 7, 8, control_error_names),
    field::bits("emergency_bits", 3, 7, 6, emergency_names),
    field::bits("warning_bits", 4, 7, 5, warning_names),
    field::flag("led_driver_warning", 4, 1),
    field::flag("cold_save_charging", 4, 0),
};

namespace detail {

consteval MessageSpec report(std::string_view name, std::uint32_t id, std::uint8_t length, Duration period,
                             std::span<const SignalSpec> signals, std::string_view meaning) {
  return {.name = name,
          .base_id = id,
          .length = length,
          .sender = Sender::charger,
          .period = period,
          .signals = signals,
          .meaning = meaning};
}

}  // namespace detail

inline constexpr MessageSpec control{.name = "BRUSA_CONTROL",
                                     .base_id = 0x618,
                                     .length = 7,
                                     .sender = Sender::bmu,
                                     .period = 100ms,
                                     .signals = control_signals,
                                     .meaning = "whether it is to charge, and the most it may take and give"};
inline constexpr MessageSpec status =
    detail::report("BRUSA_STATUS", 0x610, 4, 100ms, status_signals, "its state, and what holds it back");
inline constexpr MessageSpec actual_1 =
    detail::report("BRUSA_ACTUAL_1", 0x611, 8, 100ms, actual_1_signals, "mains and battery, voltage and current");
inline constexpr MessageSpec actual_2 = detail::report("BRUSA_ACTUAL_2", 0x612, 8, 100ms, actual_2_signals,
                                                       "limits of the mains, auxiliary battery, charge counted");
inline constexpr MessageSpec temperatures = detail::report("BRUSA_TEMPERATURE", 0x613, 8, 1s, temperature_signals,
                                                           "its power stage and three external sensors");
inline constexpr MessageSpec errors =
    detail::report("BRUSA_ERRORS", 0x614, 5, 1s, error_signals, "every error and warning, a bit each");

inline constexpr const MessageSpec* rows[] = {&control, &status, &actual_1, &actual_2, &temperatures, &errors};
inline constexpr Catalogue catalogue{"brusa_nlg5", rows};

extern const ChargerDriver driver;

inline constexpr Device device{.name = "brusa_nlg5",
                               .title = "Brusa NLG5 charger",
                               .kind = DeviceKind::charger,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "one charger, commanded ten times a second",
                               .charger = &driver};

}  // namespace bmu::brusa_nlg5
