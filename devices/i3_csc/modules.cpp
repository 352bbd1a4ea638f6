// Driver of the modules of an i3, which polls each module with a command of its own.
#include "devices/i3_csc/i3_csc.hpp"
#include "devices/measured_value.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::i3_csc {

namespace {

constexpr std::size_t cells_per_frame = 3;
constexpr std::size_t first_temperature = signal_index(temperatures, "temperature_1_dC");
constexpr std::size_t board_temperature = signal_index(temperatures, "board_temperature_dC");
constexpr std::uint8_t start_rounds = 3;
constexpr std::int64_t start_code = 4;  // in the last start round
constexpr std::int64_t mode_balance = 0x08;
constexpr std::int64_t mode_idle_car = 0x20;
/// Target voltage of a command without bleeding: as sent by the car, and by other masters.
constexpr std::int32_t idle_target_car_uV = 4'295'000;
constexpr std::int32_t idle_target_others_uV = 4'200'000;
constexpr std::int64_t flag_module_balances = 2;  // set for all its cells, bled or not

constexpr ModulePart cells_parts[] = {ModulePart::cells_1, ModulePart::cells_2, ModulePart::cells_3,
                                      ModulePart::cells_4};

/// The manufacturer's number of a node, which counts from 0.
constexpr std::uint8_t maker_number(std::uint8_t node) {
  return static_cast<std::uint8_t>(node - 1);
}

ModuleParts parts_of(std::uint8_t cell_count) {
  ModuleParts parts = bit_of(ModulePart::status) | bit_of(ModulePart::temperatures) | bit_of(ModulePart::voltage);
  for (std::size_t block = 0; block * cells_per_frame < cell_count; ++block) parts |= bit_of(cells_parts[block]);
  return parts;
}

CanFrame ask(const ModuleQuestion& question, std::uint32_t round, const ModuleOptions& options) {
  CanFrame frame = make_frame(command, maker_number(question.node));
  const std::int32_t idle_uV = options.idle_as_others ? idle_target_others_uV : idle_target_car_uV;
  write<command, "target_voltage_uV">(frame, question.bleed_above_uV.value_or(idle_uV));
  write<command, "want_voltages">(frame, question.wants_voltages && !question.is_start ? 1 : 0);
  write<command, "want_temperatures">(frame, question.wants_temperatures && !question.is_start ? 1 : 0);
  const std::int64_t idle = options.idle_as_others ? 0 : mode_idle_car;
  write<command, "mode">(frame, question.bleed_above_uV ? mode_balance : idle);
  const bool is_last_of_start = question.is_start && round + 1 == start_rounds;
  write<command, "start_code">(frame, is_last_of_start ? start_code : 0);
  constexpr std::uint32_t counter_values = 15;
  seal(command, static_cast<std::uint8_t>((round + 1) % counter_values), frame);
  return frame;
}

ModuleReport read_status(const CanFrame& frame) {
  ModuleReport report{.parts = bit_of(ModulePart::status)};
  report.bleeding_cells = static_cast<std::uint16_t>(read_raw<status, "balancing_cells">(frame));
  report.errors = static_cast<std::uint32_t>(read_raw<status, "errors">(frame));
  return report;
}

ModuleReport read_temperatures(const CanFrame& frame) {
  ModuleReport report{.parts = bit_of(ModulePart::temperatures)};
  for (std::size_t sensor = 0; sensor < temperatures_per_module; ++sensor) {
    report.cell_temperature_dC.push_back(decode_signal(temperature_signals[first_temperature + sensor], frame.data));
  }
  report.board_temperature_dC = read<temperatures, "board_temperature_dC">(frame);
  return report;
}

ModuleReport read_cells(std::size_t block, const CanFrame& frame) {
  ModuleReport report{.parts = bit_of(cells_parts[block])};
  report.first_cell = static_cast<std::uint8_t>(block * cells_per_frame);
  for (std::size_t slot = 0; slot < cells_per_frame; ++slot) {
    report.cell_voltage_uV.push_back(decode_signal(cells_rows[block]->signals[slot], frame.data));
  }
  return report;
}

ModuleReport take(const CanFrame& frame, const ModuleOptions&) {
  const MessageMatch match = catalogue.find(frame);
  ModuleReport report;
  if (match.message == &status) report = read_status(frame);
  if (match.message == &temperatures) report = read_temperatures(frame);
  if (match.message == &voltage) {
    report.parts = bit_of(ModulePart::voltage);
    report.stack_voltage_mV = read<voltage, "module_voltage_mV">(frame);
  }
  for (std::size_t block = 0; block < std::size(cells_rows); ++block) {
    if (match.message == cells_rows[block]) report = read_cells(block, frame);
  }
  if (report.parts != 0) report.node = static_cast<std::uint8_t>(match.node + 1);
  return report;
}

std::optional<ModuleQuestion> question_of(const CanFrame& frame) {
  const MessageMatch match = catalogue.find(frame);
  if (match.message != &command || content_fault(command, frame)) return std::nullopt;
  ModuleQuestion question{.node = static_cast<std::uint8_t>(match.node + 1),
                          .wants_voltages = read_raw<command, "want_voltages">(frame) != 0,
                          .wants_temperatures = read_raw<command, "want_temperatures">(frame) != 0};
  question.is_start = !question.wants_voltages && !question.wants_temperatures;
  if (read_raw<command, "mode">(frame) == mode_balance) {
    question.bleed_above_uV = static_cast<std::int32_t>(read<command, "target_voltage_uV">(frame).value);
  }
  return question;
}

CanFrame sealed(const MessageSpec& row, std::uint8_t counter, CanFrame frame) {
  seal(row, counter, frame);
  return frame;
}

CanFrame status_frame(std::uint8_t number, const ModuleMeasurements& measured) {
  CanFrame frame = make_frame(status, number);
  write<status, "errors">(frame, measured.errors);
  write<status, "balancing_cells">(frame, measured.bleeding_cells);
  return frame;
}

CanFrame cells_frame(std::uint8_t number, std::size_t block, const ModuleMeasurements& measured) {
  const MessageSpec& row = *cells_rows[block];
  CanFrame frame = make_frame(row, number);
  const std::int64_t flags = measured.bleeding_cells != 0 ? flag_module_balances : 0;
  for (std::size_t slot = 0; slot < cells_per_frame; ++slot) {
    const std::size_t cell = block * cells_per_frame + slot;
    encode_measured(row.signals[slot], measured.cell_voltage_uV[cell], frame.data);
    encode_signal(row.signals[cells_per_frame + slot], known(flags), frame.data);
  }
  return frame;
}

CanFrame temperatures_frame(std::uint8_t number, const ModuleMeasurements& measured) {
  CanFrame frame = make_frame(temperatures, number);
  for (std::size_t sensor = 0; sensor < temperatures_per_module; ++sensor) {
    encode_measured(temperature_signals[first_temperature + sensor], measured.cell_temperature_dC[sensor], frame.data);
  }
  encode_measured(temperature_signals[board_temperature], measured.board_temperature_dC, frame.data);
  return frame;
}

CanFrame voltage_frame(std::uint8_t number, const ModuleMeasurements& measured) {
  CanFrame frame = make_frame(voltage, number);
  write<voltage, "module_voltage_mV">(frame, measured.stack_voltage_mV);
  return frame;
}

/// A frame with the same data in every answer.
struct TypeFrame {
  const MessageSpec* row;
  std::array<std::uint8_t, 8> data;
};
constexpr TypeFrame type_frames[] = {
    {&type_1, {0x11}}, {&type_2, {0x22, 0x22, 0x22, 0x22, 0x25, 0x22, 0x42, 0x22}}, {&type_3, {}}};
CanFrame type_frame(const TypeFrame& type, std::uint8_t number) {
  CanFrame frame = make_frame(*type.row, number);
  frame.data = type.data;
  return frame;
}

ModuleFrames answers(std::uint8_t node, const ModuleQuestion& question, const ModuleMeasurements& measured,
                     std::uint8_t counter, const ModuleOptions&) {
  const std::uint8_t number = maker_number(node);
  ModuleFrames frames;
  frames.push_back(sealed(status, counter, status_frame(number, measured)));
  for (const TypeFrame& type : type_frames) frames.push_back(type_frame(type, number));
  for (std::size_t block = 0; block < std::size(cells_rows) && question.wants_voltages; ++block) {
    frames.push_back(sealed(*cells_rows[block], counter, cells_frame(number, block, measured)));
  }
  if (question.wants_voltages) frames.push_back(sealed(voltage, counter, voltage_frame(number, measured)));
  if (question.wants_temperatures) {
    frames.push_back(sealed(temperatures, counter, temperatures_frame(number, measured)));
  }
  return frames;
}

}  // namespace

const ModuleDriver driver{.name = "i3_csc",
                          .catalogue = &catalogue,
                          .node_max = node_max + 1,
                          .maker_less = 1,
                          .cell_count_max = cells_per_module,
                          .temperature_count_max = temperatures_per_module,
                          .has_board_temperature = true,
                          .asks_each = true,
                          .start_rounds = start_rounds,
                          .frames_per_answer = 10,
                          .round_min = 24ms,
                          .round_max = 400ms,
                          .answer_after = 0ms,
                          .answer_within = 20ms,
                          .sample_age_max = 24ms,
                          .has_checksum = true,
                          .tells_stack_voltage = true,
                          .tells_errors = true,
                          .parts_of = parts_of,
                          .ask = ask,
                          .take = take,
                          .question_of = question_of,
                          .answers = answers};

}  // namespace bmu::i3_csc
