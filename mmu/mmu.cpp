#include "mmu/mmu.hpp"

#include <algorithm>
#include <bit>

namespace bmu {

using internal_bus::CommandResult;
using internal_bus::Mode;

namespace {

constexpr Duration master_silence_max = 1s;
constexpr Duration wake_up_time = 50ms;
constexpr Duration listening_time = 1s;
constexpr Duration announcement_spacing = 10ms;
// Long enough to answer the command and for the master to see the mode in a STATUS it had already asked for.
constexpr Duration falling_asleep_time = 10ms;
// What the front end can measure: a limit above this could never be exceeded.
constexpr std::int32_t limit_max_uV = 5'000'000;
// End of the thermistor's table.
constexpr std::int64_t board_temperature_limit_max_dC = 1'250;
constexpr std::int32_t board_hysteresis_dC = 50;
constexpr Duration age_max = 254ms;  // the largest STATUS can say

}  // namespace

Mmu::Mmu(const MmuConfig& config, TimePoint powered_at)
    : config_(config),
      answers_from_(powered_at),
      polled_at_(powered_at),
      sampling_(powered_at, CellSampler::period),
      temperatures_(powered_at, internal_bus::temperature_sampling_period),
      balancing_(powered_at),
      announces_at_(powered_at + announcement_spacing * config.node) {}

void Mmu::restart(TimePoint now) {
  const MmuCounts counts = counts_;
  *this = Mmu(config_, now);
  counts_ = counts;
}

// --- what comes in --------------------------------------------------------------------------------------------------

void Mmu::observe(const CanFrame& frame, TimePoint now) {
  if (is_asleep_) {
    wake(now);  // the frame that wakes is itself lost, as with a real transceiver
    return;
  }
  const std::uint32_t command_id = internal_bus::command.base_id;
  const bool concerns_us =
      frame.id == internal_bus::poll.base_id || frame.id == command_id || frame.id == command_id + config_.node;
  if (!concerns_us) return;
  const CheckedFrame checked = check_.check(frame);
  if (!checked.is_accepted) return;
  note_master(now);
  if (checked.message == &internal_bus::poll) {
    observe_poll(frame, now);
  } else {
    observe_command(frame, checked.node, now);
  }
}

/// Sleep keeps limits, node number and failures; it is no restart. Measuring begins again, talking does not: traffic
/// alone is no master, and modules that announce themselves on any traffic would wake each other for ever.
void Mmu::wake(TimePoint now) {
  is_asleep_ = false;
  is_listening_ = true;
  listens_until_ = now + listening_time;
  mode_ = Mode::starting;
  answers_from_ = now + wake_up_time;
  polled_at_ = now;
  sampling_ = Periodic(now, CellSampler::period);
  temperatures_ = Periodic(now, internal_bus::temperature_sampling_period);
  sampler_ = {};
  balancing_ = CommandedBalancing(now);
  check_.forget_counters();
}

/// A valid POLL, to whomever, or a COMMAND to this module or to all.
void Mmu::note_master(TimePoint now) {
  if (!is_listening_) return;
  is_listening_ = false;
  announces_at_ = now + announcement_spacing * config_.node;
  is_announcement_due_ = true;
}

void Mmu::observe_poll(const CanFrame& frame, TimePoint now) {
  polled_at_ = now;
  const std::int64_t target = read_raw<internal_bus::poll, "target_node">(frame);
  const bool is_for_us = target == 0 || target == config_.node;
  if (!is_for_us || now < answers_from_) return;
  if (answer_.left != 0) ++counts_.answers_cut_short;
  answer_ = {.left = parts_wanted(frame),
             .counter = static_cast<std::uint8_t>(read_raw<internal_bus::poll, "counter">(frame)),
             .is_started = false,
             .next_frame_at = now,
             .cells = snapshot(read_raw<internal_bus::poll, "sync">(frame) != 0, now)};
}

std::uint16_t Mmu::parts_wanted(const CanFrame& poll) const {
  const auto wanted = [](bool is_wanted, unsigned parts) { return is_wanted ? parts : 0U; };
  const unsigned cells_frames =
      (config_.cell_count + internal_bus::cells_per_frame - 1U) / internal_bus::cells_per_frame;
  const unsigned cells_parts = ((1U << cells_frames) - 1U) << Part::cells_1;
  return static_cast<std::uint16_t>(
      wanted(read_raw<internal_bus::poll, "want_status">(poll) != 0, 1U << Part::status) |
      wanted(read_raw<internal_bus::poll, "want_cells">(poll) != 0, cells_parts) |
      wanted(read_raw<internal_bus::poll, "want_temp">(poll) != 0, (1U << Part::temp_1) | (1U << Part::temp_2)) |
      wanted(read_raw<internal_bus::poll, "want_module">(poll) != 0, 1U << Part::module) |
      wanted(read_raw<internal_bus::poll, "want_ident">(poll) != 0, 1U << Part::ident));
}

/// With SYNC the latest single sample: at most one sampling period old, and the one being taken when the POLL arrives
/// could not be waited for, since the answer must start within 2 ms. Voltages whose age can no longer be said are not
/// sent as voltages.
CellReading Mmu::snapshot(bool is_sync, TimePoint now) const {
  CellReading reading = is_sync ? sampler_.latest() : sampler_.average();
  if (now - reading.taken_at > age_max) reading.measured = 0;
  return reading;
}

void Mmu::observe_command(const CanFrame& frame, std::uint8_t node, TimePoint now) {
  const CommandResult result = execute(frame, node, now);
  ++(result == CommandResult::done ? counts_.commands_done : counts_.commands_refused);
  if (node == 0) return;
  const Response response{.operation = static_cast<std::uint8_t>(read_raw<internal_bus::command, "operation">(frame)),
                          .counter = static_cast<std::uint8_t>(read_raw<internal_bus::command, "counter">(frame)),
                          .result = result};
  // Room for four in one tick is more than a master that waits for responses ever needs; beyond that the oldest stand.
  (void)responses_.try_push_back(response);
}

// --- commands -------------------------------------------------------------------------------------------------------

const std::array<Mmu::Operation, 8> Mmu::operations{nullptr,
                                                    &Mmu::set_mode,
                                                    &Mmu::set_limits,
                                                    &Mmu::balance,
                                                    &Mmu::stop_balancing,
                                                    &Mmu::clear_faults,
                                                    &Mmu::set_node,
                                                    &Mmu::set_board_temperature_limit};

CommandResult Mmu::execute(const CanFrame& frame, std::uint8_t node, TimePoint now) {
  const auto code = static_cast<std::size_t>(read_raw<internal_bus::command, "operation">(frame));
  if (code >= operations.size() || operations[code] == nullptr) return CommandResult::unknown_operation;
  const bool is_for_all_only = code == static_cast<std::size_t>(internal_bus::Operation::set_node);
  if (is_for_all_only && node != 0) return CommandResult::bad_argument;
  return (this->*operations[code])(frame, now);
}

CommandResult Mmu::set_mode(const CanFrame& frame, TimePoint now) {
  const std::int64_t wanted = read_raw<internal_bus::command, "mode">(frame);
  const bool is_normal = wanted == static_cast<std::int64_t>(Mode::normal);
  const bool is_sleep = wanted == static_cast<std::int64_t>(Mode::going_to_sleep);
  if (!is_normal && !is_sleep) return CommandResult::bad_argument;
  autonomous_balancing_allowed_ = read_raw<internal_bus::command, "autonomous_balancing_allowed">(frame) != 0;
  if (is_sleep) {
    mode_ = Mode::going_to_sleep;
    sleeps_at_ = now + falling_asleep_time;
    balancing_.stop();
  } else if (mode_ == Mode::going_to_sleep) {
    mode_ = sampler_.average().exists() ? Mode::normal : Mode::starting;
  }
  return CommandResult::done;
}

CommandResult Mmu::set_limits(const CanFrame& frame, TimePoint /*now*/) {
  const std::int64_t undervoltage_uV = read<internal_bus::command, "undervoltage_limit_uV">(frame).value;
  const std::int64_t overvoltage_uV = read<internal_bus::command, "overvoltage_limit_uV">(frame).value;
  if (undervoltage_uV >= overvoltage_uV || overvoltage_uV > limit_max_uV) return CommandResult::bad_argument;
  protection_.set_limits({.undervoltage_uV = static_cast<std::int32_t>(undervoltage_uV),
                          .overvoltage_uV = static_cast<std::int32_t>(overvoltage_uV)});
  are_limits_set_ = true;
  return CommandResult::done;
}

/// Refused as a whole if any cell's minutes are: 6, time for a cell that is not there, or for one that has failed.
CommandResult Mmu::balance(const CanFrame& frame, TimePoint /*now*/) {
  if (mode_ != Mode::normal) return CommandResult::refused_in_this_mode;
  constexpr std::size_t first = signal_index(internal_bus::command, "balancing_time_1_s");
  CommandedBalancing::Minutes minutes{};
  CellMask starting = 0;
  for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
    minutes[cell] = static_cast<std::uint8_t>(raw_of(internal_bus::command.signals[first + cell], frame.data));
    if (minutes[cell] == CommandedBalancing::keep_minutes) continue;
    if (minutes[cell] > CommandedBalancing::minutes_max) return CommandResult::bad_argument;
    if (minutes[cell] > 0) starting = static_cast<CellMask>(starting | cell_bit(cell));
  }
  if ((starting & ~first_cells(config_.cell_count)) != 0) return CommandResult::bad_argument;
  if ((starting & protection_.failed()) != 0) return CommandResult::refused_in_this_mode;
  balancing_.command(minutes);
  return CommandResult::done;
}

CommandResult Mmu::stop_balancing(const CanFrame& /*frame*/, TimePoint /*now*/) {
  balancing_.stop();
  return CommandResult::done;
}

CommandResult Mmu::clear_faults(const CanFrame& /*frame*/, TimePoint /*now*/) {
  protection_.clear();
  has_crc_errors_ = false;
  return CommandResult::done;
}

CommandResult Mmu::set_node(const CanFrame& frame, TimePoint now) {
  const std::int64_t node = read_raw<internal_bus::command, "new_node">(frame);
  const bool is_meant = read_raw<internal_bus::command, "serial_number">(frame) == config_.serial_number;
  if (!is_meant || node < 1 || node > internal_bus::node_count_max) return CommandResult::bad_argument;
  config_.node = static_cast<std::uint8_t>(node);
  answer_ = {};  // an answer under way belongs to the old number
  announces_at_ = now + announcement_spacing * config_.node;
  is_announcement_due_ = true;
  return CommandResult::done;
}

CommandResult Mmu::set_board_temperature_limit(const CanFrame& frame, TimePoint /*now*/) {
  const std::int64_t limit_dC = read<internal_bus::command, "board_temperature_limit_dC">(frame).value;
  if (limit_dC <= 0 || limit_dC > board_temperature_limit_max_dC) return CommandResult::bad_argument;
  board_temperature_limit_dC_ = static_cast<std::int32_t>(limit_dC);
  return CommandResult::done;
}

// --- the tick -------------------------------------------------------------------------------------------------------

MmuFrames Mmu::tick(TimePoint now, const MmuMeasurements& measured) {
  MmuFrames out;
  if (is_asleep_) return out;
  measure(now, measured);
  update_balancing(now);
  send_responses(out);
  send_announcement(now, out);
  send_answer(now, out);
  if (out.empty()) fall_asleep_if_due(now);  // its own last frame must not wake it
  return out;
}

void Mmu::measure(TimePoint now, const MmuMeasurements& measured) {
  if (!sampling_.take(now)) return;
  if (temperatures_.take(now)) measure_temperatures(measured);
  is_self_test_ok_ = measured.self_test_ok;
  has_crc_errors_ = has_crc_errors_ || !measured.front_end_crc_ok;
  auto step = CellSampler::Step::sampled;
  if (measured.front_end_crc_ok) {
    const auto fitted = static_cast<CellMask>(measured.measured_cells & first_cells(config_.cell_count));
    step = sampler_.add(measured.cell_voltage_uV, fitted, now);
    module_mV_ = measured.module_mV;
    open_wires_ = measured.open_wires;
  } else {
    step = sampler_.add_damaged();
  }
  if (step != CellSampler::Step::average_complete) return;
  const bool is_new = sampler_.average().exists() && now - sampler_.average().taken_at < CellSampler::period * 10;
  if (!is_new) return;  // every transfer of this window was damaged
  protection_.check(sampler_.average());
  if (mode_ == Mode::starting) mode_ = Mode::normal;
}

void Mmu::measure_temperatures(const MmuMeasurements& measured) {
  cell_temperature_dC_ = measured.cell_temperature_dC;
  board_temperature_dC_ = measured.board_temperature_dC;
  const std::int32_t threshold_dC = board_temperature_limit_dC_ - (is_board_too_hot_ ? board_hysteresis_dC : 0);
  is_board_too_hot_ =
      std::any_of(board_temperature_dC_.begin(), board_temperature_dC_.end(),
                  [threshold_dC](const SignalValue& one) { return one.is_valid() && one.value > threshold_dC; });
}

void Mmu::update_balancing(TimePoint now) {
  if (protection_.failed() != 0) balancing_.stop(protection_.failed());
  if (now - polled_at_ >= master_silence_max) balancing_.stop();
  balancing_.update(now, is_board_too_hot_);
}

void Mmu::fall_asleep_if_due(TimePoint now) {
  const bool is_obeying = mode_ == Mode::going_to_sleep && now >= sleeps_at_ && answer_.left == 0;
  const bool is_alone = is_listening_ && now >= listens_until_;
  if (!is_obeying && !is_alone) return;
  is_asleep_ = true;
  is_announcement_due_ = false;
}

// --- what goes out --------------------------------------------------------------------------------------------------

void Mmu::send_responses(MmuFrames& out) {
  for (const Response& response : responses_) {
    CanFrame frame = make_frame(internal_bus::response, config_.node);
    write<internal_bus::response, "operation">(frame, response.operation);
    write<internal_bus::response, "result">(frame, static_cast<std::int64_t>(response.result));
    seal(internal_bus::response, response.counter, frame);
    out.push_back(frame);
  }
  responses_.clear();
}

void Mmu::send_announcement(TimePoint now, MmuFrames& out) {
  if (!is_announcement_due_ || now < announces_at_ || mode_ == Mode::going_to_sleep) return;
  is_announcement_due_ = false;
  CanFrame frame = make_ident();
  seal(internal_bus::ident, 0, frame);
  out.push_back(frame);
}

void Mmu::send_answer(TimePoint now, MmuFrames& out) {
  while (answer_.left != 0 && now >= answer_.next_frame_at) {
    if (!answer_.is_started) {
      answer_.is_started = true;
      answer_.next_frame_at = now;
      ++counts_.polls_answered;
    }
    const auto part = static_cast<std::uint8_t>(std::countr_zero(answer_.left));
    out.push_back(make_part(part, now));
    answer_.left = static_cast<std::uint16_t>(answer_.left & ~(1U << part));
    answer_.next_frame_at += config_.frame_spacing;
  }
}

CanFrame Mmu::make_part(std::uint8_t part, TimePoint now) {
  CanFrame frame;
  const MessageSpec* row = nullptr;
  switch (static_cast<Part>(part)) {
    case Part::status: row = &internal_bus::status, frame = make_status(now); break;
    case Part::cells_1:
    case Part::cells_2:
    case Part::cells_3:
    case Part::cells_4:
      row = internal_bus::cells_rows[part - Part::cells_1];
      frame = make_cells(static_cast<std::size_t>(part - Part::cells_1));
      break;
    case Part::temp_1: row = &internal_bus::temp_1, frame = make_temp_1(); break;
    case Part::temp_2: row = &internal_bus::temp_2, frame = make_temp_2(); break;
    case Part::module: row = &internal_bus::module, frame = make_module(); break;
    case Part::ident: row = &internal_bus::ident, frame = make_ident(); break;
  }
  BMU_ASSERT(row != nullptr);
  seal(*row, answer_.counter, frame);
  return frame;
}

/// The two "since the last STATUS" flags are told once.
CanFrame Mmu::make_status(TimePoint now) {
  const auto is_faulty = [](const SignalValue& one) {
    return !one.is_valid() && one.validity != Validity::not_fitted && one.validity != Validity::unknown;
  };
  const bool has_sensor_fault = std::any_of(cell_temperature_dC_.begin(), cell_temperature_dC_.end(), is_faulty) ||
                                std::any_of(board_temperature_dC_.begin(), board_temperature_dC_.end(), is_faulty);
  const Duration age = now - answer_.cells.taken_at;
  const bool is_age_known = answer_.cells.exists() && age <= age_max;

  CanFrame frame = make_frame(internal_bus::status, config_.node);
  write<internal_bus::status, "mode">(frame, static_cast<std::int64_t>(mode_));
  write<internal_bus::status, "balancing">(frame, balancing_.switches() != 0);
  write<internal_bus::status, "cell_count">(frame, config_.cell_count);
  write<internal_bus::status, "limits_not_set">(frame, !are_limits_set_);
  write<internal_bus::status, "temperature_sensor_fault">(frame, has_sensor_fault);
  write<internal_bus::status, "restarted">(frame, is_restarted_);
  write<internal_bus::status, "board_too_hot">(frame, is_board_too_hot_);
  write<internal_bus::status, "open_cell_wire">(frame, open_wires_ != 0);
  write<internal_bus::status, "self_test_failed">(frame, !is_self_test_ok_);
  write<internal_bus::status, "front_end_crc_errors">(frame, has_crc_errors_);
  write<internal_bus::status, "undervoltage_cells">(frame, protection_.undervoltage());
  write<internal_bus::status, "overvoltage_cells">(frame, protection_.overvoltage());
  write<internal_bus::status, "cell_voltage_age_ms">(frame, is_age_known ? known(to_ms(age)) : not_known());
  is_restarted_ = false;
  has_crc_errors_ = false;
  return frame;
}

CanFrame Mmu::make_cells(std::size_t frame_index) const {
  const MessageSpec& row = *internal_bus::cells_rows[frame_index];
  CanFrame frame = make_frame(row, config_.node);
  for (std::size_t slot = 0; slot < internal_bus::cells_per_frame; ++slot) {
    const std::size_t cell = frame_index * internal_bus::cells_per_frame + slot;
    const bool is_measured = has_cell(answer_.cells.measured, cell);
    const SignalValue value =
        is_measured ? known(answer_.cells.cell_voltage_uV[cell]) : not_known(Validity::not_fitted);
    encode_signal(row.signals[slot], value, frame.data);
  }
  return frame;
}

CanFrame Mmu::make_temp_1() const {
  CanFrame frame = make_frame(internal_bus::temp_1, config_.node);
  for (std::size_t sensor = 0; sensor < 3; ++sensor) {
    encode_signal(internal_bus::temp_1.signals[sensor], cell_temperature_dC_[sensor], frame.data);
  }
  return frame;
}

CanFrame Mmu::make_temp_2() const {
  CanFrame frame = make_frame(internal_bus::temp_2, config_.node);
  encode_signal(internal_bus::temp_2.signals[0], cell_temperature_dC_[3], frame.data);
  for (std::size_t sensor = 0; sensor < mmu_board_temperatures; ++sensor) {
    encode_signal(internal_bus::temp_2.signals[1 + sensor], board_temperature_dC_[sensor], frame.data);
  }
  return frame;
}

CanFrame Mmu::make_module() const {
  const auto minutes_left = std::chrono::ceil<std::chrono::minutes>(balancing_.longest_time_left());
  CanFrame frame = make_frame(internal_bus::module, config_.node);
  write<internal_bus::module, "module_voltage_mV">(frame, module_mV_);
  write<internal_bus::module, "balancing_cells">(frame, balancing_.switches());
  write<internal_bus::module, "open_wire_cells">(frame, open_wires_);
  write<internal_bus::module, "balancing_time_left_s">(frame, std::chrono::seconds(minutes_left).count());
  return frame;
}

CanFrame Mmu::make_ident() const {
  CanFrame frame = make_frame(internal_bus::ident, config_.node);
  write<internal_bus::ident, "protocol_version">(frame, internal_bus::protocol_version);
  write<internal_bus::ident, "cell_count">(frame, config_.cell_count);
  write<internal_bus::ident, "temperature_sensor_count">(frame, config_.temperature_sensor_count);
  write<internal_bus::ident, "serial_number">(frame, config_.serial_number);
  return frame;
}

}  // namespace bmu
