// Bender iso165C insulation monitor: little-endian, three frames. Its command numbers are decimal.
//
// By the manufacturer's manual of October 2019: 250 kbit/s is the iso165C, 500 kbit/s the iso165C-1; as delivered the
// error threshold is 55 kOhm, the warning threshold 300 kOhm (iso165C-1: 250 and 400 kOhm), and the averaging factor 3.
//
// An iso175 has the same identifiers with eight bytes and another layout: 037h is decoded with six bytes only.
//
// Sources disagree on the bit of `command_error`: b4 .4 in the manufacturer's DBC and manual, which is used here, b4 .3
// in one reader. The layout of answers without a signal here (status, version, temperature, maker's data) is unknown.
//
// A voltage must be requested, settles over seconds and is updated once a second; insulation and HV1 require closed
// relays of HV1 (command 210).
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::iso165c {

inline constexpr RawName command_names[] = {{33, "self-test"},
                                            {34, "calibrate"},
                                            {40, "set error threshold"},
                                            {41, "set warning threshold"},
                                            {43, "set averaging"},
                                            {50, "read error threshold"},
                                            {51, "read version"},
                                            {53, "read resistance"},
                                            {54, "read HV1 voltage"},
                                            {55, "read extended status"},
                                            {57, "read warning threshold"},
                                            {58, "read HV2 voltage"},
                                            {60, "read averaging"},
                                            {61, "read maker's data"},
                                            {200, "reset"},
                                            {201, "set power mode"},
                                            {202, "lock"},
                                            {203, "switch measurement"},
                                            {210, "set HV relay"},
                                            {220, "read status"},
                                            {221, "read HV relay"},
                                            {222, "read controller's version"},
                                            {223, "read power mode"},
                                            {224, "read lock"},
                                            {225, "read temperature"},
                                            {226, "read alive"},
                                            {255, "error"}};
inline constexpr RawName self_test_names[] = {{0, "none"}, {1, "overall"}, {2, "parameters"}};
inline constexpr RawName power_mode_names[] = {{0, "off"}, {1, "on"}, {2, "power up"}, {3, "power down"}};
inline constexpr RawName relay_names[] = {{0, "HV1-"}, {1, "HV1+"}};
inline constexpr RawName bias_names[] = {{1, "HV1-"}, {2, "HV1+"}};
inline constexpr RawName lock_names[] = {{0, "unlocked"}, {1, "locked"}, {2, "blocked by retries"}, {100, "unknown"}};
/// The numbers from 1032 on repeat those from 32 on; the difference between both is unknown.
inline constexpr RawName error_names[] = {{32, "timeout"},
                                          {33, "checksum"},
                                          {34, "invalid parameter"},
                                          {35, "unknown command"},
                                          {36, "EEPROM write"},
                                          {37, "repeated or missing frame"},
                                          {1'000, "command locked"},
                                          {1'001, "queue full"},
                                          {1'002, "not available"},
                                          {1'032, "timeout"},
                                          {1'033, "checksum"},
                                          {1'034, "invalid parameter"},
                                          {1'035, "unknown command"},
                                          {1'037, "repeated or missing frame"},
                                          {1'038, "no response"},
                                          {1'039, "communication"},
                                          {1'040, "invalid response"}};

inline constexpr SignalSpec info_signals[] = {
    field::little("insulation_resistance_Ohm", 0, 2, field::kOhm),
    field::flag("insulation_failure", 2, 0),
    field::flag("chassis_fault", 2, 1),
    field::flag("system_fault", 2, 2),
    field::flag("calibrating", 2, 3),
    field::flag("testing_itself", 2, 4),
    field::flag("insulation_warning", 2, 5),
    field::flag("measurement_off", 4, 0),
    field::flag("controllers_parted", 4, 1),
    field::flag("other_controller_silent", 4, 2),
    field::flag("command_error", 4, 4),
    field::flag("resistance_outdated", 5, 0),
    field::flag("self_test_pending", 5, 4),
    field::flag("parameter_test_pending", 5, 5),
};

namespace detail {

inline constexpr SignalSpec command = field::named(field::u8("command", 0), command_names);
inline constexpr SignalSpec error_threshold =
    field::within(30, 1'000, field::little("error_threshold_Ohm", 1, 2, field::kOhm));
inline constexpr SignalSpec warning_threshold =
    field::within(40, 2'000, field::little("warning_threshold_Ohm", 1, 2, field::kOhm));
inline constexpr SignalSpec averaging = field::within(1, 20, field::little("averaging_factor", 1, 2));

}  // namespace detail

inline constexpr SignalSpec request_signals[] = {
    detail::command,
    field::when(33, field::named(field::little("self_test", 1, 2), self_test_names)),
    field::when(34, field::within(1, 6, field::little("calibration_step", 1, 2))),
    field::when(40, detail::error_threshold),
    field::when(41, detail::warning_threshold),
    field::when(43, detail::averaging),
    field::when(201, field::named(field::little("power_mode", 1, 2), power_mode_names)),
    field::when(202, field::little("lock_mode", 1, 2)),
    field::when(202, field::little("password", 3, 2)),
    field::when(203, field::little("measurement", 1, 2)),
    field::when(210, field::named(field::little("relay", 1, 2), relay_names)),
    field::when(210, field::little("relay_state", 3, 2)),
};
inline constexpr SignalSpec response_signals[] = {
    detail::command,
    field::when(50, detail::error_threshold),
    field::when(53, field::little("insulation_resistance_Ohm", 1, 2, field::kOhm)),
    field::when(53, field::named(field::u8("bias", 3), bias_names)),
    field::when(53, field::u8("measurement_count", 4)),
    field::when(54, field::little("hv1_voltage_mV", 1, 2, field::whole_V)),
    field::when(57, detail::warning_threshold),
    field::when(58, field::little("hv2_voltage_mV", 1, 2, field::whole_V)),
    field::when(60, detail::averaging),
    field::when(223, field::named(field::little("power_mode", 1, 2), power_mode_names)),
    field::when(224, field::named(field::little("lock", 1, 2), lock_names)),
    field::when(255, field::named(field::little("error_code", 1, 2), error_names)),
    field::when(255, field::u8("rejected_command", 3)),
};

inline constexpr MessageSpec info{.name = "ISO165_INFO",
                                  .base_id = 0x037,
                                  .length = 6,
                                  .sender = Sender::insulation_monitor,
                                  .period = 1s,
                                  .signals = info_signals,
                                  .meaning = "insulation resistance, and what is wrong with it or the monitor"};
inline constexpr MessageSpec request{.name = "ISO165_REQUEST",
                                     .base_id = 0x022,
                                     .length = 5,
                                     .sender = Sender::bmu,
                                     .signals = request_signals,
                                     .meaning = "a command to the monitor"};
inline constexpr MessageSpec response{.name = "ISO165_RESPONSE",
                                      .base_id = 0x023,
                                      .length = 5,
                                      .sender = Sender::insulation_monitor,
                                      .signals = response_signals,
                                      .meaning = "its answer"};

inline constexpr const MessageSpec* rows[] = {&info, &request, &response};
inline constexpr Catalogue catalogue{"iso165c", rows};

extern const InsulationDriver driver;

inline constexpr std::uint32_t bit_rates[] = {bit_rate_250k, bit_rate_500k};
inline constexpr Device device{.name = "iso165c",
                               .title = "Bender iso165C insulation monitor",
                               .kind = DeviceKind::insulation_monitor,
                               .catalogue = &catalogue,
                               .bit_rates = bit_rates,
                               .meaning = "insulation once a second, and commands with their answers",
                               .insulation = &driver};

}  // namespace bmu::iso165c
