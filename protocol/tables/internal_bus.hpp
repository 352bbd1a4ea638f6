// The internal bus: master, module management units, power distribution unit, current sensor. Protocol version 1.
//
// These rows define the protocol. docs/bus-protocol.md describes it in prose; a difference between both is a bug.
#pragma once

#include "protocol/message.hpp"

namespace bmu::internal_bus {

inline constexpr std::uint8_t node_count_max = 63;
inline constexpr std::uint8_t cells_per_module_max = 12;
inline constexpr std::uint8_t cell_temperatures_per_module_max = 4;
inline constexpr std::uint8_t board_temperatures_per_module = 4;
inline constexpr std::uint8_t protocol_version = 1;

// --- special codes and names ----------------------------------------------------------------------------------------

inline constexpr SpecialCode cell_voltage_codes[] = {{0xFFFF, Validity::not_fitted}};
inline constexpr SpecialCode module_voltage_codes[] = {{0xFFFF, Validity::unknown}};
inline constexpr SpecialCode cell_temperature_codes[] = {
    {-0x8000, Validity::not_fitted}, {-0x7FFF, Validity::open_circuit}, {0x7FFF, Validity::short_circuit}};
inline constexpr SpecialCode board_temperature_codes[] = {{-0x80, Validity::not_fitted},
                                                          {0x7F, Validity::sensor_fault}};
inline constexpr SpecialCode age_codes[] = {{0xFF, Validity::unknown}};
inline constexpr SpecialCode balance_codes[] = {{7, Validity::unchanged}};
inline constexpr SpecialCode insulation_codes[] = {{0xFFFF, Validity::unknown}, {0xFFFE, Validity::above_range}};
inline constexpr SpecialCode throttle_codes[] = {{0xFF, Validity::unknown}};

enum class Mode : std::uint8_t { starting = 0, normal = 1, autonomous = 2, going_to_sleep = 3 };
inline constexpr RawName mode_names[] = {{0, "starting"}, {1, "normal"}, {2, "autonomous"}, {3, "going to sleep"}};
inline constexpr RawName supply_names[] = {{0, "external"}, {1, "module"}};

enum class Operation : std::uint8_t {
  set_mode = 1,
  set_limits = 2,
  balance = 3,
  stop_balancing = 4,
  clear_faults = 5,
  set_node = 6,
  set_board_temperature_limit = 7,
};
inline constexpr RawName operation_names[] = {{1, "set mode"},
                                              {2, "set limits"},
                                              {3, "balance"},
                                              {4, "stop balancing"},
                                              {5, "clear faults"},
                                              {6, "set node"},
                                              {7, "set board temperature limit"}};

enum class CommandResult : std::uint8_t {
  done = 0,
  unknown_operation = 1,
  bad_argument = 2,
  refused_in_this_mode = 3,
  hardware_fault = 4,
};
inline constexpr RawName result_names[] = {
    {0, "done"}, {1, "unknown operation"}, {2, "bad argument"}, {3, "refused in this mode"}, {4, "hardware fault"}};

inline constexpr RawName insulation_monitor_names[] = {{0, "no signal"},   {1, "normal"},       {2, "undervoltage"},
                                                       {3, "speed start"}, {4, "device error"}, {5, "earth fault"}};

// --- module management units -----------------------------------------------------------------------------------------

inline constexpr SignalSpec counter_signal{.name = "counter", .first_bit = byte(6), .bit_count = 8};

inline constexpr SignalSpec poll_signals[] = {
    {.name = "target_node", .first_bit = byte(0), .bit_count = 8},
    {.name = "sync", .first_bit = bit(1, 7), .bit_count = 1},
    {.name = "want_ident", .first_bit = bit(1, 4), .bit_count = 1},
    {.name = "want_module", .first_bit = bit(1, 3), .bit_count = 1},
    {.name = "want_temp", .first_bit = bit(1, 2), .bit_count = 1},
    {.name = "want_cells", .first_bit = bit(1, 1), .bit_count = 1},
    {.name = "want_status", .first_bit = bit(1, 0), .bit_count = 1},
    counter_signal,
};
inline constexpr MessageSpec poll{.name = "POLL",
                                  .base_id = 0x080,
                                  .protection = Protection::counter_crc,
                                  .sender = Sender::bmu,
                                  .period = 100ms,
                                  .signals = poll_signals,
                                  .meaning = "what one module (or all, target 0) is to send"};

inline constexpr SignalSpec status_signals[] = {
    {.name = "mode", .first_bit = bit(0, 7), .bit_count = 2, .names = mode_names},
    {.name = "supply", .first_bit = bit(0, 5), .bit_count = 1, .names = supply_names},
    {.name = "balancing", .first_bit = bit(0, 4), .bit_count = 1},
    {.name = "cell_count", .first_bit = bit(0, 3), .bit_count = 4},
    {.name = "limits_not_set", .first_bit = bit(1, 7), .bit_count = 1},
    {.name = "temperature_sensor_fault", .first_bit = bit(1, 6), .bit_count = 1},
    {.name = "restarted", .first_bit = bit(1, 5), .bit_count = 1},
    {.name = "external_supply_low", .first_bit = bit(1, 4), .bit_count = 1},
    {.name = "board_too_hot", .first_bit = bit(1, 3), .bit_count = 1},
    {.name = "open_cell_wire", .first_bit = bit(1, 2), .bit_count = 1},
    {.name = "self_test_failed", .first_bit = bit(1, 1), .bit_count = 1},
    {.name = "front_end_crc_errors", .first_bit = bit(1, 0), .bit_count = 1},
    {.name = "undervoltage_cells", .first_bit = byte(2), .bit_count = 12},
    {.name = "overvoltage_cells", .first_bit = bit(3, 3), .bit_count = 12},
    {.name = "cell_voltage_age_ms", .first_bit = byte(5), .bit_count = 8, .unit = Unit::ms, .special = age_codes},
    counter_signal,
};
inline constexpr MessageSpec status{
    .name = "STATUS",
    .base_id = 0x100,
    .node_min = 1,
    .node_max = node_count_max,
    .protection = Protection::counter_crc,
    .sender = Sender::mmu,
    .signals = status_signals,
    .meaning = "mode, supply and faults of a module; masks have cell 1 in the lowest bit"};

namespace detail {

consteval SignalSpec cell_voltage(std::string_view name, unsigned first_byte) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(first_byte * 8),
          .bit_count = 16,
          .unit = Unit::uV,
          .scale = 100,
          .special = cell_voltage_codes};
}
consteval SignalSpec cell_temperature(std::string_view name, unsigned first_byte) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(first_byte * 8),
          .bit_count = 16,
          .unit = Unit::dC,
          .is_signed = true,
          .special = cell_temperature_codes};
}
consteval SignalSpec board_temperature(std::string_view name, unsigned first_byte) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(first_byte * 8),
          .bit_count = 8,
          .unit = Unit::dC,
          .scale = 10,
          .is_signed = true,
          .special = board_temperature_codes};
}
consteval MessageSpec module_answer(std::string_view name, std::uint16_t base_id, std::span<const SignalSpec> signals,
                                    std::string_view meaning) {
  return {.name = name,
          .base_id = base_id,
          .node_min = 1,
          .node_max = node_count_max,
          .protection = Protection::counter_crc,
          .sender = Sender::mmu,
          .signals = signals,
          .meaning = meaning};
}

}  // namespace detail

inline constexpr SignalSpec cells_1_signals[] = {detail::cell_voltage("cell_voltage_1_uV", 0),
                                                 detail::cell_voltage("cell_voltage_2_uV", 2),
                                                 detail::cell_voltage("cell_voltage_3_uV", 4), counter_signal};
inline constexpr SignalSpec cells_2_signals[] = {detail::cell_voltage("cell_voltage_4_uV", 0),
                                                 detail::cell_voltage("cell_voltage_5_uV", 2),
                                                 detail::cell_voltage("cell_voltage_6_uV", 4), counter_signal};
inline constexpr SignalSpec cells_3_signals[] = {detail::cell_voltage("cell_voltage_7_uV", 0),
                                                 detail::cell_voltage("cell_voltage_8_uV", 2),
                                                 detail::cell_voltage("cell_voltage_9_uV", 4), counter_signal};
inline constexpr SignalSpec cells_4_signals[] = {detail::cell_voltage("cell_voltage_10_uV", 0),
                                                 detail::cell_voltage("cell_voltage_11_uV", 2),
                                                 detail::cell_voltage("cell_voltage_12_uV", 4), counter_signal};
inline constexpr unsigned cells_per_frame = 3;
inline constexpr MessageSpec cells_1 = detail::module_answer("CELLS_1", 0x140, cells_1_signals, "cells 1 to 3");
inline constexpr MessageSpec cells_2 = detail::module_answer("CELLS_2", 0x180, cells_2_signals, "cells 4 to 6");
inline constexpr MessageSpec cells_3 = detail::module_answer("CELLS_3", 0x1C0, cells_3_signals, "cells 7 to 9");
inline constexpr MessageSpec cells_4 = detail::module_answer("CELLS_4", 0x200, cells_4_signals, "cells 10 to 12");
/// CELLS_1 to CELLS_4 in order; each row's first three signals are its cell voltages.
inline constexpr const MessageSpec* cells_rows[] = {&cells_1, &cells_2, &cells_3, &cells_4};

inline constexpr SignalSpec temp_1_signals[] = {detail::cell_temperature("cell_temperature_1_dC", 0),
                                                detail::cell_temperature("cell_temperature_2_dC", 2),
                                                detail::cell_temperature("cell_temperature_3_dC", 4), counter_signal};
inline constexpr SignalSpec temp_2_signals[] = {
    detail::cell_temperature("cell_temperature_4_dC", 0),   detail::board_temperature("board_temperature_1_dC", 2),
    detail::board_temperature("board_temperature_2_dC", 3), detail::board_temperature("board_temperature_3_dC", 4),
    detail::board_temperature("board_temperature_4_dC", 5), counter_signal};
inline constexpr MessageSpec temp_1 = detail::module_answer("TEMP_1", 0x240, temp_1_signals, "cell sensors 1 to 3");
inline constexpr MessageSpec temp_2 =
    detail::module_answer("TEMP_2", 0x280, temp_2_signals, "cell sensor 4 and the board sensors");

inline constexpr SignalSpec module_signals[] = {
    {.name = "module_voltage_mV",
     .first_bit = byte(0),
     .bit_count = 16,
     .unit = Unit::mV,
     .scale = 2,
     .special = module_voltage_codes},
    {.name = "balancing_cells", .first_bit = byte(2), .bit_count = 12},
    {.name = "open_wire_cells", .first_bit = bit(3, 3), .bit_count = 12},
    // Decision 0028: 0 from a module built before these bits; its minutes never reach them.
    {.name = "front_end_faults_reported", .first_bit = bit(5, 7), .bit_count = 1},
    {.name = "front_end_supply_low", .first_bit = bit(5, 6), .bit_count = 1},
    {.name = "front_end_thermal_shutdown", .first_bit = bit(5, 5), .bit_count = 1},
    {.name = "balancing_time_left_s", .first_bit = bit(5, 4), .bit_count = 5, .unit = Unit::s, .scale = 60},
    counter_signal,
};
inline constexpr MessageSpec module = detail::module_answer(
    "MODULE", 0x2C0, module_signals, "voltage of the whole stack, switches, open wires, front end");

inline constexpr SignalSpec ident_signals[] = {
    {.name = "protocol_version", .first_bit = byte(0), .bit_count = 8},
    {.name = "cell_count", .first_bit = bit(1, 7), .bit_count = 4},
    {.name = "temperature_sensor_count", .first_bit = bit(1, 3), .bit_count = 4},
    {.name = "serial_number", .first_bit = byte(2), .bit_count = 32},
    counter_signal,
};
inline constexpr MessageSpec ident =
    detail::module_answer("IDENT", 0x300, ident_signals, "who a module is; counter 0 when it was not asked");

namespace detail {

consteval SignalSpec argument(Operation operation, SignalSpec signal) {
  signal.selected_by = static_cast<std::int16_t>(operation);
  return signal;
}
consteval SignalSpec balance_minutes(std::string_view name, unsigned cell_index) {
  return argument(Operation::balance, {.name = name,
                                       .first_bit = static_cast<std::uint8_t>(8 + 3 * cell_index),
                                       .bit_count = 3,
                                       .unit = Unit::s,
                                       .scale = 60,
                                       .special = balance_codes,
                                       .raw_limit = 5});
}
consteval SignalSpec limit_voltage(std::string_view name, unsigned first_byte) {
  return argument(Operation::set_limits, {.name = name,
                                          .first_bit = static_cast<std::uint8_t>(first_byte * 8),
                                          .bit_count = 16,
                                          .unit = Unit::uV,
                                          .scale = 100});
}

}  // namespace detail

inline constexpr SignalSpec command_signals[] = {
    {.name = "operation", .first_bit = byte(0), .bit_count = 8, .names = operation_names},
    detail::argument(Operation::set_mode, {.name = "mode", .first_bit = byte(1), .bit_count = 8, .names = mode_names}),
    detail::argument(Operation::set_mode,
                     {.name = "autonomous_balancing_allowed", .first_bit = bit(2, 0), .bit_count = 1}),
    detail::limit_voltage("undervoltage_limit_uV", 1),
    detail::limit_voltage("overvoltage_limit_uV", 3),
    detail::balance_minutes("balancing_time_1_s", 0),
    detail::balance_minutes("balancing_time_2_s", 1),
    detail::balance_minutes("balancing_time_3_s", 2),
    detail::balance_minutes("balancing_time_4_s", 3),
    detail::balance_minutes("balancing_time_5_s", 4),
    detail::balance_minutes("balancing_time_6_s", 5),
    detail::balance_minutes("balancing_time_7_s", 6),
    detail::balance_minutes("balancing_time_8_s", 7),
    detail::balance_minutes("balancing_time_9_s", 8),
    detail::balance_minutes("balancing_time_10_s", 9),
    detail::balance_minutes("balancing_time_11_s", 10),
    detail::balance_minutes("balancing_time_12_s", 11),
    detail::argument(Operation::set_node, {.name = "new_node", .first_bit = byte(1), .bit_count = 8}),
    detail::argument(Operation::set_node, {.name = "serial_number", .first_bit = byte(2), .bit_count = 32}),
    detail::argument(
        Operation::set_board_temperature_limit,
        {.name = "board_temperature_limit_dC", .first_bit = byte(1), .bit_count = 8, .unit = Unit::dC, .scale = 10}),
    counter_signal,
};
inline constexpr MessageSpec command{.name = "COMMAND",
                                     .base_id = 0x340,
                                     .node_min = 0,
                                     .node_max = node_count_max,
                                     .node_0_is_all = true,
                                     .protection = Protection::counter_crc,
                                     .sender = Sender::bmu,
                                     .signals = command_signals,
                                     .meaning = "an order to one module, or to all (node 0)"};

inline constexpr SignalSpec response_signals[] = {
    {.name = "operation", .first_bit = byte(0), .bit_count = 8, .names = operation_names},
    {.name = "result", .first_bit = byte(1), .bit_count = 8, .names = result_names},
    counter_signal,
};
inline constexpr MessageSpec response =
    detail::module_answer("RESPONSE", 0x380, response_signals, "what became of a COMMAND");

// --- power distribution unit -----------------------------------------------------------------------------------------

/// Validity of a contactor command: a PDU that receives no new valid one within this time opens everything.
inline constexpr Duration contactor_command_life = 200ms;

/// Maximum periods of a module's measurements.
inline constexpr Duration cell_sampling_period = 10ms;
inline constexpr Duration temperature_sampling_period = 500ms;

inline constexpr SignalSpec contactor_command_signals[] = {
    {.name = "heater", .first_bit = bit(0, 6), .bit_count = 1},
    {.name = "fan", .first_bit = bit(0, 5), .bit_count = 1},
    {.name = "auxiliary", .first_bit = bit(0, 4), .bit_count = 1},
    {.name = "charge", .first_bit = bit(0, 3), .bit_count = 1},
    {.name = "precharge", .first_bit = bit(0, 2), .bit_count = 1},
    {.name = "main_negative", .first_bit = bit(0, 1), .bit_count = 1},
    {.name = "main_positive", .first_bit = bit(0, 0), .bit_count = 1},
    {.name = "complement", .first_bit = byte(1), .bit_count = 8},
    counter_signal,
};
inline constexpr MessageSpec contactor_command{.name = "CONTACTOR_COMMAND",
                                               .base_id = 0x040,
                                               .protection = Protection::counter_crc_complement,
                                               .sender = Sender::bmu,
                                               .period = 50ms,
                                               .signals = contactor_command_signals,
                                               .meaning = "what the PDU is to close; expires after 200 ms"};

inline constexpr SignalSpec pdu_status_signals[] = {
    {.name = "opened_by_timeout", .first_bit = bit(0, 7), .bit_count = 1},
    {.name = "heater_on", .first_bit = bit(0, 6), .bit_count = 1},
    {.name = "fan_on", .first_bit = bit(0, 5), .bit_count = 1},
    {.name = "auxiliary_on", .first_bit = bit(0, 4), .bit_count = 1},
    {.name = "charge_closed", .first_bit = bit(0, 3), .bit_count = 1},
    {.name = "precharge_closed", .first_bit = bit(0, 2), .bit_count = 1},
    {.name = "main_negative_closed", .first_bit = bit(0, 1), .bit_count = 1},
    {.name = "main_positive_closed", .first_bit = bit(0, 0), .bit_count = 1},
    // Decision 0028: 0 from a PDU without such a loop.
    {.name = "alarm_loop_open", .first_bit = bit(1, 7), .bit_count = 1},
    {.name = "resume_button", .first_bit = bit(1, 6), .bit_count = 1},
    {.name = "insulation_monitor_ok", .first_bit = bit(1, 5), .bit_count = 1},
    {.name = "interlock_closed", .first_bit = bit(1, 4), .bit_count = 1},
    {.name = "estop_2_released", .first_bit = bit(1, 3), .bit_count = 1},
    {.name = "estop_1_released", .first_bit = bit(1, 2), .bit_count = 1},
    {.name = "charger_connected", .first_bit = bit(1, 1), .bit_count = 1},
    {.name = "vehicle_on", .first_bit = bit(1, 0), .bit_count = 1},
    {.name = "insulation_resistance_Ohm",
     .first_bit = byte(2),
     .bit_count = 16,
     .unit = Unit::Ohm,
     .scale = 1'000,
     .special = insulation_codes},
    {.name = "insulation_monitor_state", .first_bit = byte(4), .bit_count = 8, .names = insulation_monitor_names},
    {.name = "throttle_permille",
     .first_bit = byte(5),
     .bit_count = 8,
     .unit = Unit::permille,
     .scale = 5,
     .special = throttle_codes,
     .raw_limit = 200},
    counter_signal,
};
inline constexpr MessageSpec pdu_status{.name = "PDU_STATUS",
                                        .base_id = 0x041,
                                        .protection = Protection::counter_crc,
                                        .sender = Sender::pdu,
                                        .period = 50ms,
                                        .signals = pdu_status_signals,
                                        .meaning = "auxiliary contacts, inputs, insulation"};

inline constexpr SignalSpec pdu_temperature_signals[] = {detail::cell_temperature("intake_air_temperature_dC", 0),
                                                         counter_signal};
/// Sent only by PDUs with such a sensor.
inline constexpr MessageSpec pdu_temperature{.name = "PDU_TEMPERATURE",
                                             .base_id = 0x042,
                                             .protection = Protection::counter_crc,
                                             .sender = Sender::pdu,
                                             .period = 1s,
                                             .signals = pdu_temperature_signals,
                                             .meaning = "intake air; only of units with such a sensor"};

// --- current and voltage sensor (IVT-S as delivered) ----------------------------------------------------------------

namespace detail {

/// Plausibility limits: twice the range of the largest variant, which measures 2500 A and 1000 V.
inline constexpr std::int64_t sensor_current_limit_mA = 5'000'000;
inline constexpr std::int64_t sensor_voltage_limit_mV = 2'000'000;

consteval std::int64_t sensor_limit(Unit unit) {
  return unit == Unit::mA ? sensor_current_limit_mA : unit == Unit::mV ? sensor_voltage_limit_mV : 0;
}

consteval SignalSpec sensor_value(std::string_view name, Unit unit, std::int64_t scale, ByteOrder order) {
  return {.name = name,
          .first_bit = byte(2),
          .bit_count = 32,
          .unit = unit,
          .scale = scale,
          .is_signed = true,
          .order = order,
          .raw_limit = sensor_limit(unit)};
}
inline constexpr SignalSpec sensor_channel{.name = "channel", .first_bit = byte(0), .bit_count = 8};
inline constexpr SignalSpec sensor_system_error{.name = "system_error", .first_bit = bit(1, 7), .bit_count = 1};
inline constexpr SignalSpec sensor_any_error{.name = "any_measurement_error", .first_bit = bit(1, 6), .bit_count = 1};
inline constexpr SignalSpec sensor_error{.name = "measurement_error", .first_bit = bit(1, 5), .bit_count = 1};
inline constexpr SignalSpec sensor_overcurrent{.name = "overcurrent", .first_bit = bit(1, 4), .bit_count = 1};
inline constexpr SignalSpec sensor_counter{.name = "counter", .first_bit = bit(1, 3), .bit_count = 4};

}  // namespace detail

/// Signals and row of one result of the sensor, including results that are not used on this bus.
consteval std::array<SignalSpec, 7> sensor_signals(std::string_view name, Unit unit, std::int64_t scale,
                                                   ByteOrder order) {
  return {detail::sensor_value(name, unit, scale, order),
          detail::sensor_channel,
          detail::sensor_system_error,
          detail::sensor_any_error,
          detail::sensor_error,
          detail::sensor_overcurrent,
          detail::sensor_counter};
}
consteval MessageSpec sensor_result(std::string_view name, std::uint16_t id, std::uint8_t channel, Duration period,
                                    std::span<const SignalSpec> signals, std::string_view meaning) {
  return {.name = name,
          .base_id = id,
          .length = 6,
          .protection = Protection::channel_counter,
          .sender = Sender::sensor,
          .period = period,
          .channel = channel,
          .signals = signals,
          .meaning = meaning};
}

inline constexpr auto sensor_current_signals = sensor_signals("pack_current_mA", Unit::mA, 1, ByteOrder::big);
inline constexpr auto sensor_current_2_signals = sensor_signals("pack_current_2_mA", Unit::mA, 1, ByteOrder::big);
inline constexpr auto sensor_u1_signals = sensor_signals("pack_voltage_mV", Unit::mV, 1, ByteOrder::big);
inline constexpr auto sensor_u2_signals = sensor_signals("link_voltage_mV", Unit::mV, 1, ByteOrder::big);
inline constexpr auto sensor_charge_signals =
    sensor_signals("charge_counter_uAs", Unit::uAs, 1'000'000, ByteOrder::big);
inline constexpr auto sensor_energy_signals = sensor_signals("energy_counter_mWh", Unit::mWh, 1'000, ByteOrder::big);
inline constexpr MessageSpec sensor_current =
    sensor_result("SENSOR_CURRENT", 0x521, 0, 20ms, sensor_current_signals, "pack current, positive = discharge");
inline constexpr MessageSpec sensor_u1 =
    sensor_result("SENSOR_U1", 0x522, 1, 60ms, sensor_u1_signals, "voltage on the pack side of the contactors");
inline constexpr MessageSpec sensor_u2 =
    sensor_result("SENSOR_U2", 0x523, 2, 60ms, sensor_u2_signals, "voltage on the load side: the link");
inline constexpr MessageSpec sensor_current_2 = sensor_result(
    "SENSOR_CURRENT_2", 0x531, 0, 20ms, sensor_current_2_signals, "the same current from a second sensor, when fitted");
inline constexpr MessageSpec sensor_charge =
    sensor_result("SENSOR_CHARGE", 0x527, 6, 0ms, sensor_charge_signals, "charge counter, when enabled");
inline constexpr MessageSpec sensor_energy =
    sensor_result("SENSOR_ENERGY", 0x528, 7, 0ms, sensor_energy_signals, "energy counter, when enabled");

// The same six results from sensors configured for little-endian values.
inline constexpr auto sensor_current_le_signals = sensor_signals("pack_current_mA", Unit::mA, 1, ByteOrder::little);
inline constexpr auto sensor_current_2_le_signals = sensor_signals("pack_current_2_mA", Unit::mA, 1, ByteOrder::little);
inline constexpr auto sensor_u1_le_signals = sensor_signals("pack_voltage_mV", Unit::mV, 1, ByteOrder::little);
inline constexpr auto sensor_u2_le_signals = sensor_signals("link_voltage_mV", Unit::mV, 1, ByteOrder::little);
inline constexpr auto sensor_charge_le_signals =
    sensor_signals("charge_counter_uAs", Unit::uAs, 1'000'000, ByteOrder::little);
inline constexpr auto sensor_energy_le_signals =
    sensor_signals("energy_counter_mWh", Unit::mWh, 1'000, ByteOrder::little);
inline constexpr MessageSpec sensor_current_le =
    sensor_result("SENSOR_CURRENT", 0x521, 0, 20ms, sensor_current_le_signals, "pack current, positive = discharge");
inline constexpr MessageSpec sensor_u1_le =
    sensor_result("SENSOR_U1", 0x522, 1, 60ms, sensor_u1_le_signals, "voltage on the pack side of the contactors");
inline constexpr MessageSpec sensor_u2_le =
    sensor_result("SENSOR_U2", 0x523, 2, 60ms, sensor_u2_le_signals, "voltage on the load side: the link");
inline constexpr MessageSpec sensor_current_2_le =
    sensor_result("SENSOR_CURRENT_2", 0x531, 0, 20ms, sensor_current_2_le_signals,
                  "the same current from a second sensor, when fitted");
inline constexpr MessageSpec sensor_charge_le =
    sensor_result("SENSOR_CHARGE", 0x527, 6, 0ms, sensor_charge_le_signals, "charge counter, when enabled");
inline constexpr MessageSpec sensor_energy_le =
    sensor_result("SENSOR_ENERGY", 0x528, 7, 0ms, sensor_energy_le_signals, "energy counter, when enabled");

// --- the bus ---------------------------------------------------------------------------------------------------------

inline constexpr const MessageSpec* rows[] = {&contactor_command,
                                              &pdu_status,
                                              &pdu_temperature,
                                              &poll,
                                              &status,
                                              &cells_1,
                                              &cells_2,
                                              &cells_3,
                                              &cells_4,
                                              &temp_1,
                                              &temp_2,
                                              &module,
                                              &ident,
                                              &command,
                                              &response,
                                              &sensor_current,
                                              &sensor_u1,
                                              &sensor_u2,
                                              &sensor_charge,
                                              &sensor_energy,
                                              &sensor_current_2};
inline constexpr const MessageSpec* rows_little_endian_sensor[] = {&contactor_command,
                                                                   &pdu_status,
                                                                   &pdu_temperature,
                                                                   &poll,
                                                                   &status,
                                                                   &cells_1,
                                                                   &cells_2,
                                                                   &cells_3,
                                                                   &cells_4,
                                                                   &temp_1,
                                                                   &temp_2,
                                                                   &module,
                                                                   &ident,
                                                                   &command,
                                                                   &response,
                                                                   &sensor_current_le,
                                                                   &sensor_u1_le,
                                                                   &sensor_u2_le,
                                                                   &sensor_charge_le,
                                                                   &sensor_energy_le,
                                                                   &sensor_current_2_le};

inline constexpr Catalogue catalogue{"internal", rows};
inline constexpr Catalogue catalogue_little_endian_sensor{"internal", rows_little_endian_sensor};

/// Rows of a bus with third-party modules: POLL, COMMAND and all messages of MMUs are unknown identifiers on it.
inline constexpr const MessageSpec* rows_without_modules[] = {&contactor_command, &pdu_status,    &pdu_temperature,
                                                              &sensor_current,    &sensor_u1,     &sensor_u2,
                                                              &sensor_charge,     &sensor_energy, &sensor_current_2};
inline constexpr const MessageSpec* rows_without_modules_little_endian_sensor[] = {
    &contactor_command, &pdu_status,       &pdu_temperature,  &sensor_current_le,  &sensor_u1_le,
    &sensor_u2_le,      &sensor_charge_le, &sensor_energy_le, &sensor_current_2_le};
inline constexpr Catalogue catalogue_without_modules{"internal", rows_without_modules};
inline constexpr Catalogue catalogue_without_modules_little_endian_sensor{"internal",
                                                                          rows_without_modules_little_endian_sensor};

static_assert(check_catalogue(catalogue));
static_assert(check_catalogue(catalogue_without_modules));
static_assert(check_catalogue(catalogue_without_modules_little_endian_sensor));
static_assert(check_catalogue(catalogue_little_endian_sensor));

}  // namespace bmu::internal_bus
