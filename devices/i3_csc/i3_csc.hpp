// Modules of a BMW i3: eight of twelve cells each, 500 kbit/s, little-endian; they replace MMUs, because their
// identifiers are those of MMUs. Modules count from 0 here: a command to module n is 080h + n, its answers are 100h + n
// to 1D0h + n.
//
// Commands and most answers have a counter from 0 to 14 in b6 .7-.4 and a checksum in b7; 110h, 1C0h, 1D0h and the
// frames that assign numbers have none. A module answers its own valid command only. No source states whether the
// counter of an answer is related to that of its command, nor how soon a module can answer: if an earlier command was
// not answered, it is unknown which command an answer belongs to (ModuleTable).
//
// A module that balances does so by itself, above the voltage of its command, and cells read low while they are bled:
// measure while no module balances. All cells of such a module have `flags` 10b, bled or not; only the bitmap of 100h
// shows which of them are bled.
//
// Sources disagree on:
//   - b4 of an idle command: 20h from the car, 0 from others;
//   - 160h: the voltage of the module, as it fits the sum of its cells in every frame checked; others call it a raw
//     temperature, or a balancing value;
//   - the identifier under which a module without number sends its serial number: 0F0h or 4A0h. Both are rows;
//   - 0B0h: one source clears balancing and errors with it. It has neither checksum nor counter, and is never
//     sent here;
//   - the meaning of the errors of 100h. Modules of later years may answer to b3 = 10h or 90h only.
// The meaning of 110h, 1C0h and 1D0h is unknown.
#pragma once

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::i3_csc {

inline constexpr std::uint8_t node_max = 7;
inline constexpr unsigned cells_per_module = 12;
inline constexpr unsigned temperatures_per_module = 4;
/// Valid ranges of a cell voltage and of a raw temperature; any other value is rejected as out of range.
inline constexpr std::int64_t cell_min_mV = 1;
inline constexpr std::int64_t cell_max_mV = 5'000;
inline constexpr std::int64_t temperature_raw_max = 160;

inline constexpr RawName mode_names[] = {{0x00, "idle"}, {0x08, "balance"}, {0x20, "idle, as from the car"}};
inline constexpr RawName flag_names[] = {{0, "none"}, {2, "module balances"}};
inline constexpr RawName operation_names[] = {
    {0x12, "select by serial number"}, {0x37, "ask or confirm"}, {0x5B, "set number"}, {0xA1, "reset number"}};
inline constexpr RawName half_names[] = {{0xAB, "first"}, {0xBA, "second"}};
inline constexpr RawName debug_names[] = {{0xFF00'CDA2, "clear balancing and errors"}};
inline constexpr SpecialCode number_codes[] = {{0xFF, Validity::not_fitted}};

namespace detail {

/// b6 .7-.4; the receive check rejects a frame with 15.
inline constexpr SignalSpec counter = field::within(0, nibble_counter_values - 1, field::bits("counter", 6, 7, 4));

consteval SignalSpec cell(std::string_view name, unsigned place) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(16 * place),
          .bit_count = 14,
          .unit = Unit::uV,
          .scale = 1'000,
          .order = ByteOrder::little,
          .documented = {cell_min_mV, cell_max_mV}};
}
consteval SignalSpec temperature(std::string_view name, unsigned at) {
  return field::within(0, temperature_raw_max, field::u8(name, at, field::degrees_from(-40)));
}
/// The two bits above the 14 bits of a cell.
consteval SignalSpec flags(std::string_view name, unsigned place) {
  return {.name = name,
          .first_bit = static_cast<std::uint8_t>(16 * place + 14),
          .bit_count = 2,
          .order = ByteOrder::little,
          .names = flag_names};
}
consteval MessageSpec answer(std::string_view name, std::uint32_t base_id, Protection protection,
                             std::span<const SignalSpec> signals, std::string_view meaning) {
  return {.name = name,
          .base_id = base_id,
          .node_max = node_max,
          .protection = protection,
          .sender = Sender::module,
          .signals = signals,
          .meaning = meaning};
}

}  // namespace detail

inline constexpr SignalSpec command_signals[] = {
    field::little("target_voltage_uV", 0, 2, field::cell_mV),
    field::flag("want_temperatures", 3, 6),
    field::flag("want_voltages", 3, 4),
    field::named(field::u8("mode", 4), mode_names),
    detail::counter,
    field::bits("start_code", 6, 3, 4),  // 4 in one command while the car's controller starts
};
inline constexpr SignalSpec status_signals[] = {
    field::little("errors", 0, 4),
    {.name = "balancing_cells", .first_bit = bit_le(4, 0), .bit_count = 12, .order = ByteOrder::little},
    detail::counter,
};
inline constexpr SignalSpec type_1_signals[] = {field::u8("type_code", 0)};
inline constexpr SignalSpec cells_1_signals[] = {detail::cell("cell_voltage_1_uV", 0),
                                                 detail::cell("cell_voltage_2_uV", 1),
                                                 detail::cell("cell_voltage_3_uV", 2),
                                                 detail::flags("flags_1", 0),
                                                 detail::flags("flags_2", 1),
                                                 detail::flags("flags_3", 2),
                                                 detail::counter};
inline constexpr SignalSpec cells_2_signals[] = {detail::cell("cell_voltage_4_uV", 0),
                                                 detail::cell("cell_voltage_5_uV", 1),
                                                 detail::cell("cell_voltage_6_uV", 2),
                                                 detail::flags("flags_4", 0),
                                                 detail::flags("flags_5", 1),
                                                 detail::flags("flags_6", 2),
                                                 detail::counter};
inline constexpr SignalSpec cells_3_signals[] = {detail::cell("cell_voltage_7_uV", 0),
                                                 detail::cell("cell_voltage_8_uV", 1),
                                                 detail::cell("cell_voltage_9_uV", 2),
                                                 detail::flags("flags_7", 0),
                                                 detail::flags("flags_8", 1),
                                                 detail::flags("flags_9", 2),
                                                 detail::counter};
inline constexpr SignalSpec cells_4_signals[] = {detail::cell("cell_voltage_10_uV", 0),
                                                 detail::cell("cell_voltage_11_uV", 1),
                                                 detail::cell("cell_voltage_12_uV", 2),
                                                 detail::flags("flags_10", 0),
                                                 detail::flags("flags_11", 1),
                                                 detail::flags("flags_12", 2),
                                                 detail::counter};
inline constexpr SignalSpec voltage_signals[] = {field::little("module_voltage_mV", 0, 2, {Unit::mV, 1}),
                                                 detail::counter};
inline constexpr SignalSpec temperature_signals[] = {
    detail::temperature("temperature_1_dC", 0),     detail::temperature("temperature_2_dC", 1),
    detail::temperature("temperature_3_dC", 2),     detail::temperature("temperature_4_dC", 3),
    detail::temperature("board_temperature_dC", 4), detail::counter,
};
inline constexpr SignalSpec type_2_signals[] = {
    field::u8("type_code_1", 0), field::u8("type_code_2", 1), field::u8("type_code_3", 2), field::u8("type_code_4", 3),
    field::u8("type_code_5", 4), field::u8("type_code_6", 5), field::u8("type_code_7", 6), field::u8("type_code_8", 7)};
inline constexpr SignalSpec assignment_signals[] = {
    field::named(field::u8("operation", 0), operation_names),
    // Queried (FFh: modules without number), confirmed or set.
    field::when(0x37, field::u8("module_number", 1, {}, number_codes), 2, 0x5B - 0x37),
    field::when(0xA1, field::u8("reset_number", 1)),
    field::when(0x12, field::named(field::u8("serial_number_half", 1), half_names)),
    field::when(0x12, field::big("serial_number", 2, 4)),
};
inline constexpr SignalSpec debug_signals[] = {field::named(field::big("debug_command", 0, 4), debug_names),
                                               field::big("debug_argument", 4, 4)};
inline constexpr SignalSpec announce_signals[] = {field::big("serial_number_first_half", 0, 4),
                                                  field::big("serial_number_second_half", 4, 4)};

inline constexpr MessageSpec command{.name = "CSC_COMMAND",
                                     .base_id = 0x080,
                                     .node_max = node_max,
                                     .protection = Protection::nibble_counter_crc,
                                     .sender = Sender::bmu,
                                     .signals = command_signals,
                                     .meaning = "what a module is to send, and above what to bleed"};
inline constexpr MessageSpec status = detail::answer("CSC_STATUS", 0x100, Protection::nibble_counter_crc,
                                                     status_signals, "errors, and which cells are bled");
/// No source gives its length.
inline constexpr MessageSpec type_1{.name = "CSC_TYPE_1",
                                    .base_id = 0x110,
                                    .node_max = node_max,
                                    .length_min = 1,
                                    .sender = Sender::module,
                                    .signals = type_1_signals,
                                    .meaning = "always the same; what it says is not known"};
inline constexpr MessageSpec cells_1 =
    detail::answer("CSC_CELLS_1", 0x120, Protection::nibble_counter_crc, cells_1_signals, "cells 1 to 3");
inline constexpr MessageSpec cells_2 =
    detail::answer("CSC_CELLS_2", 0x130, Protection::nibble_counter_crc, cells_2_signals, "cells 4 to 6");
inline constexpr MessageSpec cells_3 =
    detail::answer("CSC_CELLS_3", 0x140, Protection::nibble_counter_crc, cells_3_signals, "cells 7 to 9");
inline constexpr MessageSpec cells_4 =
    detail::answer("CSC_CELLS_4", 0x150, Protection::nibble_counter_crc, cells_4_signals, "cells 10 to 12");
inline constexpr MessageSpec voltage =
    detail::answer("CSC_VOLTAGE", 0x160, Protection::nibble_counter_crc, voltage_signals, "voltage of the module");
inline constexpr MessageSpec temperatures =
    detail::answer("CSC_TEMPERATURES", 0x170, Protection::nibble_counter_crc, temperature_signals,
                   "four sensors at the cells, one on the board");
inline constexpr MessageSpec type_2 =
    detail::answer("CSC_TYPE_2", 0x1C0, Protection::none, type_2_signals, "flags of its type; not known which");
inline constexpr MessageSpec type_3 =
    detail::answer("CSC_TYPE_3", 0x1D0, Protection::none, type_2_signals, "flags; not known which");
inline constexpr MessageSpec assignment{.name = "CSC_ASSIGNMENT",
                                        .base_id = 0x0A0,
                                        .sender = Sender::bmu,
                                        .signals = assignment_signals,
                                        .meaning = "gives modules their numbers, by serial number"};
inline constexpr MessageSpec debug{.name = "CSC_DEBUG",
                                   .base_id = 0x0B0,
                                   .sender = Sender::bmu,
                                   .signals = debug_signals,
                                   .meaning = "clears balancing and errors, by one source; bmud never sends it"};
inline constexpr MessageSpec announce{.name = "CSC_ANNOUNCE",
                                      .base_id = 0x0F0,
                                      .sender = Sender::module,
                                      .signals = announce_signals,
                                      .meaning = "the serial number of a module that has no number"};
inline constexpr MessageSpec announce_2{.name = "CSC_ANNOUNCE_2",
                                        .base_id = 0x4A0,
                                        .sender = Sender::module,
                                        .signals = announce_signals,
                                        .meaning = "the same, to others"};

/// CSC_CELLS_1 to 4 in order; the first three signals of each are its cell voltages, the next three their flags.
inline constexpr const MessageSpec* cells_rows[] = {&cells_1, &cells_2, &cells_3, &cells_4};

inline constexpr const MessageSpec* rows[] = {&command, &status,     &type_1,  &cells_1,      &cells_2,
                                              &cells_3, &cells_4,    &voltage, &temperatures, &type_2,
                                              &type_3,  &assignment, &debug,   &announce,     &announce_2};
inline constexpr Catalogue catalogue{"i3_csc", rows};

/// Defined in modules.cpp.
extern const ModuleDriver driver;

inline constexpr Device device{.name = "i3_csc",
                               .title = "BMW i3 modules (CSC)",
                               .kind = DeviceKind::modules,
                               .catalogue = &catalogue,
                               .bit_rates = only_500k,
                               .meaning = "eight modules of twelve cells, with counter and checksum",
                               .modules = &driver};

}  // namespace bmu::i3_csc
