// Driver of the modules of an Outlander, which polls all of them with one frame.
#include <algorithm>

#include "devices/measured_value.hpp"
#include "devices/outlander_cmu/outlander_cmu.hpp"

namespace bmu::outlander_cmu {

namespace {

constexpr std::size_t cells_per_frame = 4;
constexpr std::size_t first_temperature = signal_index(status, "temperature_1_dC");
constexpr std::int64_t run_code = 3;
/// Target of the car's master with balancing off in the first 10 s after its start, below any cell's voltage;
/// afterwards it is the voltage of the lowest cell.
constexpr std::int32_t start_target_uV = 2'510'000;
/// Temperature of raw 0 in the rows, in whole degrees.
constexpr std::int32_t usual_offset_dC = -500;

ModuleParts parts_of(std::uint8_t cell_count) {
  const ModuleParts always = bit_of(ModulePart::status) | bit_of(ModulePart::temperatures);
  const ModuleParts cells =
      bit_of(ModulePart::cells_1) | (cell_count > cells_per_frame ? bit_of(ModulePart::cells_2) : 0);
  return always | cells;
}

/// Zeros in the start rounds, as from the car; modules do not answer them.
CanFrame ask(const ModuleQuestion& question, std::uint32_t, const ModuleOptions&) {
  CanFrame frame = make_frame(master);
  if (question.is_start) return frame;
  const std::int32_t idle_uV = question.idle_target_uV.value_or(start_target_uV);
  write<master, "target_voltage_uV">(frame, question.bleed_above_uV.value_or(idle_uV));
  write<master, "balancing">(frame, question.bleed_above_uV ? 1 : 0);
  write<master, "run_code">(frame, run_code);
  return frame;
}

ModuleReport read_status(const CanFrame& frame, const ModuleOptions& options) {
  ModuleReport report{.parts = bit_of(ModulePart::status) | bit_of(ModulePart::temperatures)};
  report.bleeding_cells = static_cast<std::uint16_t>(read_raw<status, "balancing_cells">(frame));
  for (std::size_t sensor = 0; sensor < temperatures_per_module; ++sensor) {
    SignalValue value = decode_signal(status_signals[first_temperature + sensor], frame.data);
    if (value.is_valid()) value.value += options.temperature_offset_dC - usual_offset_dC;
    report.cell_temperature_dC.push_back(value);
  }
  return report;
}

/// Frame of a block of cells, and the reverse: the options may exchange the two.
std::size_t frame_of(std::size_t block, const ModuleOptions& options) {
  return options.swaps_cell_frames ? 1 - block : block;
}

ModuleReport read_cells(std::size_t block, const CanFrame& frame) {
  ModuleReport report{.parts = bit_of(block == 0 ? ModulePart::cells_1 : ModulePart::cells_2)};
  report.first_cell = static_cast<std::uint8_t>(block * cells_per_frame);
  for (const SignalSpec& signal : cells_rows[block]->signals) {
    report.cell_voltage_uV.push_back(decode_signal(signal, frame.data));
  }
  return report;
}

ModuleReport take(const CanFrame& frame, const ModuleOptions& options) {
  const MessageMatch match = catalogue.find(frame);
  ModuleReport report;
  if (match.message == &status) report = read_status(frame, options);
  if (match.message == &cells_1) report = read_cells(frame_of(0, options), frame);
  if (match.message == &cells_2) report = read_cells(frame_of(1, options), frame);
  if (report.parts != 0) report.node = match.node;
  return report;
}

std::optional<ModuleQuestion> question_of(const CanFrame& frame) {
  const bool is_question = catalogue.find(frame).message == &master && frame.length == master.length;
  if (!is_question) return std::nullopt;
  const bool is_start = std::all_of(frame.data.begin(), frame.data.end(), [](std::uint8_t byte) { return byte == 0; });
  ModuleQuestion question{.wants_voltages = !is_start, .wants_temperatures = !is_start, .is_start = is_start};
  const auto target_uV = static_cast<std::int32_t>(read<master, "target_voltage_uV">(frame).value);
  const bool is_balancing = read_raw<master, "balancing">(frame) != 0;
  if (is_balancing) question.bleed_above_uV = target_uV;
  if (!is_balancing && !is_start && target_uV != start_target_uV) question.idle_target_uV = target_uV;
  return question;
}

CanFrame status_frame(std::uint8_t node, const ModuleMeasurements& measured, const ModuleOptions& options) {
  constexpr std::int64_t status_code = 0x30;
  CanFrame frame = make_frame(status, node);
  frame.data.fill(0xFF);
  write<status, "balancing_cells">(frame, measured.bleeding_cells);
  write<status, "status_code">(frame, status_code);
  for (std::size_t sensor = 0; sensor < temperatures_per_module; ++sensor) {
    SignalValue value = measured.cell_temperature_dC[sensor];
    if (value.is_valid()) value.value -= options.temperature_offset_dC - usual_offset_dC;
    encode_measured(status_signals[first_temperature + sensor], value, frame.data);
  }
  return frame;
}

ModuleFrames answers(std::uint8_t node, const ModuleQuestion& question, const ModuleMeasurements& measured,
                     std::uint8_t, const ModuleOptions& options) {
  ModuleFrames frames;
  if (question.is_start) return frames;
  frames.push_back(status_frame(node, measured, options));
  for (std::size_t place = 0; place < std::size(cells_rows); ++place) {
    CanFrame frame = make_frame(*cells_rows[place], node);
    frame.data.fill(0xFF);
    for (std::size_t slot = 0; slot < cells_per_frame && place < 2; ++slot) {
      const std::size_t cell = frame_of(place, options) * cells_per_frame + slot;
      encode_measured(cells_rows[place]->signals[slot], measured.cell_voltage_uV[cell], frame.data);
    }
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace

const ModuleDriver driver{.name = "outlander_cmu",
                          .catalogue = &catalogue,
                          .node_max = node_max,
                          .cell_count_max = cells_per_module,
                          .temperature_count_max = temperatures_per_module,
                          .start_rounds = 4,
                          .frames_per_answer = 4,
                          .round_min = 40ms,
                          .round_max = 400ms,
                          .answer_after = 15ms,
                          .answer_within = 50ms,
                          .sample_age_max = 40ms,
                          .parts_of = parts_of,
                          .ask = ask,
                          .take = take,
                          .question_of = question_of,
                          .answers = answers};

}  // namespace bmu::outlander_cmu
