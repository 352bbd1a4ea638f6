// Isabellenhuette IVT-S and IVT-MOD, a current and voltage sensor: its results, and the commands that configure it.
//
// The results that bmud uses are those of the internal bus (protocol/tables/internal_bus.hpp), the same rows; here are
// the others, the command and the response. Results are big-endian as delivered and little-endian if the sensor was
// configured so: two catalogues. Periods and identifiers of commands are big-endian in either case.
//
// A sensor is configured in three steps: stop (34h 00), configure, start (34h 01); 32h stores the configuration. At
// least 2 ms between two commands. A command is acknowledged even if it is not allowed. The sensor zeroes its counters
// when it restarts and then sends alive (BFh).
//
// The answer to 60h to 67h is assumed to be that to the command that configures the same result (A0h to A7h).
//
// Identifiers can be moved: 10h to 17h those of the results, 1Dh that of the command, 1Fh that of the response. The
// daemon never moves one. An example of the manufacturer moves the current to 624h, which is a message of the traction
// pack to its vehicle: such a sensor is not found, and on the vehicle's bus it is a second reporter.
//
// b1 of a result has four error bits in its upper half: each of them makes the value invalid. The data sheet of
// November 2020 allows 1 ms as the period of I, temperature, power, charge and energy.
//
// Sources disagree on the periods of the results as delivered. The sign of the current depends on the wiring, and can
// be inverted.
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::ivt_s {

inline constexpr RawName command_names[] = {{0x10, "set identifier of I"},
                                            {0x11, "set identifier of U1"},
                                            {0x12, "set identifier of U2"},
                                            {0x13, "set identifier of U3"},
                                            {0x14, "set identifier of T"},
                                            {0x15, "set identifier of P"},
                                            {0x16, "set identifier of charge"},
                                            {0x17, "set identifier of energy"},
                                            {0x1D, "set identifier of command"},
                                            {0x1F, "set identifier of response"},
                                            {0x20, "configure I"},
                                            {0x21, "configure U1"},
                                            {0x22, "configure U2"},
                                            {0x23, "configure U3"},
                                            {0x24, "configure T"},
                                            {0x25, "configure P"},
                                            {0x26, "configure charge"},
                                            {0x27, "configure energy"},
                                            {0x30, "reset item"},
                                            {0x31, "trigger"},
                                            {0x32, "store"},
                                            {0x33, "overcurrent test"},
                                            {0x34, "set mode"},
                                            {0x35, "set positive overcurrent"},
                                            {0x36, "set negative overcurrent"},
                                            {0x3A, "restart at bit rate"},
                                            {0x3D, "restart as delivered"},
                                            {0x3F, "restart"},
                                            {0x40, "read measurement errors"},
                                            {0x41, "read system errors"},
                                            {0x42, "read log of all time"},
                                            {0x43, "read log since reset"},
                                            {0x60, "read configuration of I"},
                                            {0x61, "read configuration of U1"},
                                            {0x62, "read configuration of U2"},
                                            {0x63, "read configuration of U3"},
                                            {0x64, "read configuration of T"},
                                            {0x65, "read configuration of P"},
                                            {0x66, "read config. of charge"},
                                            {0x67, "read config. of energy"},
                                            {0x73, "read overcurrent test time"},
                                            {0x74, "read mode"},
                                            {0x75, "read positive overcurrent"},
                                            {0x76, "read negative overcurrent"},
                                            {0x79, "read device"},
                                            {0x7A, "read software version"},
                                            {0x7B, "read serial number"},
                                            {0x7C, "read article number"}};
/// Most are the command's number plus 80h.
inline constexpr RawName response_names[] = {{0x90, "identifier of I"},
                                             {0x91, "identifier of U1"},
                                             {0x92, "identifier of U2"},
                                             {0x93, "identifier of U3"},
                                             {0x94, "identifier of T"},
                                             {0x95, "identifier of P"},
                                             {0x96, "identifier of charge"},
                                             {0x97, "identifier of energy"},
                                             {0x9D, "identifier of command"},
                                             {0x9F, "identifier of response"},
                                             {0xA0, "configuration of I"},
                                             {0xA1, "configuration of U1"},
                                             {0xA2, "configuration of U2"},
                                             {0xA3, "configuration of U3"},
                                             {0xA4, "configuration of T"},
                                             {0xA5, "configuration of P"},
                                             {0xA6, "configuration of charge"},
                                             {0xA7, "configuration of energy"},
                                             {0xB0, "item reset"},
                                             {0xB1, "triggered"},
                                             {0xB2, "stored"},
                                             {0xB3, "overcurrent test"},
                                             {0xB4, "mode"},
                                             {0xB5, "positive overcurrent"},
                                             {0xB6, "negative overcurrent"},
                                             {0xB9, "device"},
                                             {0xBA, "software version"},
                                             {0xBB, "serial number"},
                                             {0xBC, "article number"},
                                             {0xBF, "alive"},
                                             {0xFF, "wrong command"}};
/// A result, command or response with one of these identifiers collides with the traction pack's messages to its
/// vehicle.
inline constexpr RawName taken_identifier_names[] = {
    {0x620, "620h, of the traction pack"}, {0x621, "621h, of the traction pack"},
    {0x622, "622h, of the traction pack"}, {0x623, "623h, of the traction pack"},
    {0x624, "624h, of the traction pack"}, {0x625, "625h, of the traction pack"},
    {0x626, "626h, of the traction pack"}, {0x627, "627h, of the traction pack"},
    {0x628, "628h, of the traction pack"}};
inline constexpr RawName trigger_names[] = {{0, "off"}, {1, "on trigger"}, {2, "cyclic"}};
inline constexpr RawName run_names[] = {{0, "stop"}, {1, "run"}};
inline constexpr RawName bit_rate_names[] = {{2, "1 Mbit/s"}, {4, "500 kbit/s"}, {8, "250 kbit/s"}};
inline constexpr RawName channel_names[] = {{0x01, "I"}, {0x02, "U1"}, {0x04, "U2"},     {0x08, "U3"},
                                            {0x10, "T"}, {0x20, "P"},  {0x40, "charge"}, {0x80, "energy"}};

inline constexpr Duration command_pause = 2ms;
inline constexpr Duration response_time_max = 500ms;

namespace detail {

inline constexpr unsigned channel_count = 8;

/// The four fields that configure a result, in the command and in its answer.
consteval SignalSpec of_configuration(unsigned first_command, SignalSpec signal) {
  return field::when(first_command, signal, channel_count);
}

}  // namespace detail

inline constexpr SignalSpec command_signals[] = {
    field::named(field::u8("command", 0), command_names),
    field::when(0x10, field::named(field::big("new_identifier", 1, 2), taken_identifier_names), 16),
    field::when(0x10, field::big("serial_number", 3, 4), 16),
    detail::of_configuration(0x20, field::flag("sign_inverted", 1, 7)),
    detail::of_configuration(0x20, field::flag("little_endian", 1, 6)),
    detail::of_configuration(0x20, field::bits("trigger", 1, 1, 2, trigger_names)),
    detail::of_configuration(0x20, field::big("period_ms", 2, 2, field::whole_ms)),
    field::when(0x30, field::u8("reset_class", 1)),
    field::when(0x30, field::u8("reset_item", 2)),
    field::when(0x30, field::big("reset_serial_number", 3, 4)),
    field::when(0x31, field::bits("triggered_bits", 2, 7, 8, channel_names)),
    field::when(0x33, field::big("overcurrent_test_ms", 1, 2, field::whole_ms)),
    field::when(0x34, field::named(field::u8("mode", 1), run_names)),
    field::when(0x34, field::named(field::u8("mode_at_start", 2), run_names)),
    field::when(0x34, field::big("code_level", 3, 2)),
    field::when(0x35, field::as_signed(field::big("overcurrent_set_mA", 1, 2, field::whole_A)), 2),
    field::when(0x35, field::as_signed(field::big("overcurrent_reset_mA", 3, 2, field::whole_A)), 2),
    field::when(0x3A, field::named(field::u8("bit_rate", 1), bit_rate_names)),
    field::when(0x40, field::u8("read_item", 1), 4),
};
inline constexpr SignalSpec response_signals[] = {
    field::named(field::u8("response", 0), response_names),
    field::when(0x90, field::big("identifier", 1, 2), 16),
    field::when(0x90, field::big("serial_number", 3, 4), 16),
    detail::of_configuration(0xA0, field::flag("sign_inverted", 1, 7)),
    detail::of_configuration(0xA0, field::flag("little_endian", 1, 6)),
    detail::of_configuration(0xA0, field::bits("trigger", 1, 1, 2, trigger_names)),
    detail::of_configuration(0xA0, field::big("period_ms", 2, 2, field::whole_ms)),
    field::when(0xB4, field::named(field::u8("mode", 1), run_names)),
    field::when(0xB4, field::named(field::u8("mode_at_start", 2), run_names)),
    field::when(0xBF, field::big("alive_serial_number", 3, 4)),
};

/// The meaning of these bytes is known to the manufacturer only.
inline constexpr SignalSpec debug_signals[] = {field::big("debug_1", 0, 4), field::big("debug_2", 4, 4)};

inline constexpr auto u3_signals = internal_bus::sensor_signals("voltage_3_mV", Unit::mV, 1, ByteOrder::big);
inline constexpr auto temperature_signals =
    internal_bus::sensor_signals("sensor_temperature_dC", Unit::dC, 1, ByteOrder::big);
inline constexpr auto power_signals = internal_bus::sensor_signals("power_W", Unit::W, 1, ByteOrder::big);
inline constexpr auto u3_le_signals = internal_bus::sensor_signals("voltage_3_mV", Unit::mV, 1, ByteOrder::little);
inline constexpr auto temperature_le_signals =
    internal_bus::sensor_signals("sensor_temperature_dC", Unit::dC, 1, ByteOrder::little);
inline constexpr auto power_le_signals = internal_bus::sensor_signals("power_W", Unit::W, 1, ByteOrder::little);

inline constexpr MessageSpec command{.name = "IVT_COMMAND",
                                     .base_id = 0x411,
                                     .sender = Sender::bmu,
                                     .signals = command_signals,
                                     .meaning = "configures the sensor, starts, stops and asks it"};
inline constexpr MessageSpec response{.name = "IVT_RESPONSE",
                                      .base_id = 0x511,
                                      .sender = Sender::sensor,
                                      .signals = response_signals,
                                      .meaning = "what became of a command, within 500 ms"};
inline constexpr MessageSpec debug{.name = "IVT_DEBUG",
                                   .base_id = 0x510,
                                   .sender = Sender::sensor,
                                   .signals = debug_signals,
                                   .meaning = "internal to the sensor; its meaning is not known"};
inline constexpr MessageSpec u3 =
    internal_bus::sensor_result("SENSOR_U3", 0x524, 3, 60ms, u3_signals, "the third voltage");
inline constexpr MessageSpec temperature = internal_bus::sensor_result(
    "SENSOR_TEMPERATURE", 0x525, 4, 0ms, temperature_signals, "its own temperature, when enabled");
inline constexpr MessageSpec power = internal_bus::sensor_result("SENSOR_POWER", 0x526, 5, 0ms, power_signals,
                                                                 "current times first voltage, when enabled");
inline constexpr MessageSpec u3_le =
    internal_bus::sensor_result("SENSOR_U3", 0x524, 3, 60ms, u3_le_signals, "the third voltage");
inline constexpr MessageSpec temperature_le = internal_bus::sensor_result(
    "SENSOR_TEMPERATURE", 0x525, 4, 0ms, temperature_le_signals, "its own temperature, when enabled");
inline constexpr MessageSpec power_le = internal_bus::sensor_result("SENSOR_POWER", 0x526, 5, 0ms, power_le_signals,
                                                                    "current times first voltage, when enabled");

inline constexpr const MessageSpec* rows[] = {&command,
                                              &debug,
                                              &response,
                                              &internal_bus::sensor_current,
                                              &internal_bus::sensor_u1,
                                              &internal_bus::sensor_u2,
                                              &u3,
                                              &temperature,
                                              &power,
                                              &internal_bus::sensor_charge,
                                              &internal_bus::sensor_energy};
inline constexpr const MessageSpec* rows_little_endian[] = {&command,
                                                            &debug,
                                                            &response,
                                                            &internal_bus::sensor_current_le,
                                                            &internal_bus::sensor_u1_le,
                                                            &internal_bus::sensor_u2_le,
                                                            &u3_le,
                                                            &temperature_le,
                                                            &power_le,
                                                            &internal_bus::sensor_charge_le,
                                                            &internal_bus::sensor_energy_le};
inline constexpr Catalogue catalogue{"ivt_s", rows};
inline constexpr Catalogue catalogue_little_endian{"ivt_s", rows_little_endian};

/// First number of each set of commands for the channels, and the offset from a command to its answer.
inline constexpr std::uint8_t first_set_command = 0x20;
inline constexpr std::uint8_t first_read_command = 0x60;
inline constexpr std::uint8_t store_command = 0x32;
inline constexpr std::uint8_t mode_command = 0x34;
inline constexpr std::uint8_t answered = 0x80;
inline constexpr std::uint8_t alive_response = 0xBF;
inline constexpr std::uint8_t wrong_command_response = 0xFF;

extern const SensorSetUpDriver set_up;

inline constexpr std::uint32_t bit_rates[] = {bit_rate_500k, bit_rate_250k, bit_rate_1000k};
inline constexpr Device device{.name = "ivt_s",
                               .title = "Isabellenhuette IVT-S current and voltage sensor",
                               .kind = DeviceKind::current_sensor,
                               .catalogue = &catalogue,
                               .little_endian = &catalogue_little_endian,
                               .bit_rates = bit_rates,
                               .meaning = "all eight results, the command that configures them and its response",
                               .set_up = &set_up};

}  // namespace bmu::ivt_s
