#include "mmu/devices/mmu.hpp"

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
// Long enough to answer the command and for the master to receive the mode in a STATUS that it had already polled.
constexpr Duration falling_asleep_time = 10ms;
// Range of the front end: a limit above this could never be exceeded.
constexpr std::int32_t limit_max_uV = 5'000'000;
// End of the thermistor's table.
constexpr std::int64_t board_temperature_limit_max_dC = 1'250;
constexpr std::int32_t board_hysteresis_dC = 50;
// A board heated by its own resistors cools within minutes; one that does not is heated by something else.
constexpr Duration cooling_time_max = 10min;
constexpr Duration temperature_age_max = 3 * internal_bus::temperature_sampling_period;
constexpr Duration age_max = 254ms;  // the largest that STATUS can carry

/// A fitted sensor that cannot be read is sent as open: the protocol has no code for "unknown", and "not fitted" would
/// not indicate a fault.
constexpr SignalValue as_told(const SignalValue& thermistor) {
  return thermistor.validity == Validity::unknown ? not_known(Validity::open_circuit) : thermistor;
}
constexpr bool is_unreadable(const SignalValue& thermistor) {
  return !thermistor.is_valid() && thermistor.validity != Validity::not_fitted;
}

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

// --- reception -------------------------------------------------------------------------------------------------------

void Mmu::observe(const CanFrame& frame, TimePoint now) {
  if (mode_ == UnitMode::unpowered) return;
  if (mode_ == UnitMode::asleep) {
    wake(now);  // the frame that wakes is itself lost, as with a real transceiver
    return;
  }
  const std::uint32_t command_id = internal_bus::command.base_id;
  const bool concerns_us =
      frame.id == internal_bus::poll.base_id || frame.id == command_id || frame.id == command_id + config_.node;
  listens_until_ = now + listening_time;
  if (!concerns_us) return;
  // A command is not executed if its response has no room: it is lost, and the master sends it again.
  if (frame.id == command_id + config_.node && responses_.size() == responses_max) {
    ++counts_.commands_lost;
    return;
  }
  const CheckedFrame checked = check_.check(frame);
  if (!checked.is_accepted) return;
  is_listening_ = false;  // a master is present
  if (checked.message == &internal_bus::poll) {
    observe_poll(frame, now);
  } else {
    observe_command(frame, checked.node, now);
  }
}

/// Sleep keeps limits, node number and failures; it is no restart. The module sends IDENT once. A module sleeps again
/// only after the bus has been silent for longer than the last module takes to send its IDENT: otherwise the IDENTs
/// would wake the modules permanently.
void Mmu::wake(TimePoint now) {
  mode_ = UnitMode::starting;
  has_voltages_ = false;
  is_sleep_ordered_ = false;
  is_listening_ = true;
  listens_until_ = now + listening_time;
  answers_from_ = now + wake_up_time;
  polled_at_ = now;
  announces_at_ = now + announcement_spacing * config_.node;
  is_announcement_due_ = true;
  sampling_ = Periodic(now, CellSampler::period);
  temperatures_ = Periodic(now, internal_bus::temperature_sampling_period);
  sampler_ = {};
  module_taken_at_.reset();
  diagnosis_read_at_.reset();
  supply_ = {};
  imbalance_ = {};
  balancing_ = Balancing(now);
  check_.forget_counters();
}

/// Makes an autonomous module normal at once, so that it follows the master's next command.
void Mmu::observe_poll(const CanFrame& frame, TimePoint now) {
  polled_at_ = now;
  if (mode_ == UnitMode::autonomous) update_mode(now);
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

/// With SYNC the latest single sample, which is at most one sampling period old: the answer must start within 2 ms, too
/// soon for the sample that is being taken when the POLL arrives. Voltages with an age that STATUS cannot carry are not
/// sent as voltages.
CellReading Mmu::snapshot(bool is_sync, TimePoint now) const {
  const CellReading& reading = is_sync ? sampler_.latest() : sampler_.average();
  return reading.only(reading.taken_since(now - age_max));
}

void Mmu::observe_command(const CanFrame& frame, std::uint8_t node, TimePoint now) {
  const CommandResult result = execute(frame, node, now);
  ++(result == CommandResult::done ? counts_.commands_done : counts_.commands_refused);
  if (node == 0) return;
  const Response response{.operation = static_cast<std::uint8_t>(read_raw<internal_bus::command, "operation">(frame)),
                          .counter = static_cast<std::uint8_t>(read_raw<internal_bus::command, "counter">(frame)),
                          .result = result};
  responses_.push_back(response);  // observe() has checked the capacity
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

CommandResult Mmu::set_mode(const CanFrame& frame, TimePoint /*now*/) {
  const std::int64_t wanted = read_raw<internal_bus::command, "mode">(frame);
  const bool is_normal = wanted == static_cast<std::int64_t>(Mode::normal);
  const bool is_sleep = wanted == static_cast<std::int64_t>(Mode::going_to_sleep);
  if (!is_normal && !is_sleep) return CommandResult::bad_argument;
  autonomous_balancing_allowed_ = read_raw<internal_bus::command, "autonomous_balancing_allowed">(frame) != 0;
  is_sleep_ordered_ = is_sleep;
  if (is_sleep) balancing_.stop();
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

/// Refused completely if the minutes of any cell are: 6, time for a missing cell, for one that has failed, or for one
/// that cannot be bled because it or its board is not measured.
CommandResult Mmu::balance(const CanFrame& frame, TimePoint now) {
  if (mode_ != UnitMode::normal || is_sleep_ordered_) return CommandResult::refused_in_this_mode;
  constexpr std::size_t first = signal_index(internal_bus::command, "balancing_time_1_s");
  Balancing::Minutes minutes{};
  CellMask starting = 0;
  for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
    minutes[cell] = static_cast<std::uint8_t>(raw_of(internal_bus::command.signals[first + cell], frame.data));
    if (minutes[cell] == Balancing::keep_minutes) continue;
    if (minutes[cell] > Balancing::minutes_max) return CommandResult::bad_argument;
    if (minutes[cell] > 0) starting = static_cast<CellMask>(starting | cell_bit(cell));
  }
  if ((starting & ~first_cells(config_.cell_count)) != 0) return CommandResult::bad_argument;
  if ((starting & protection_.failed()) != 0) return CommandResult::refused_in_this_mode;
  const bool is_seen = (starting & ~bleedable_cells(now)) == 0 && is_board_known_;
  if (starting != 0 && !is_seen) return CommandResult::hardware_fault;
  balancing_.command(minutes);
  return CommandResult::done;
}

CommandResult Mmu::stop_balancing(const CanFrame& /*frame*/, TimePoint /*now*/) {
  balancing_.stop();
  return CommandResult::done;
}

CommandResult Mmu::clear_faults(const CanFrame& /*frame*/, TimePoint /*now*/) {
  protection_.clear();
  heat_.clear();
  front_end_faults_ = {};
  has_crc_errors_ = false;
  return CommandResult::done;
}

CommandResult Mmu::set_node(const CanFrame& frame, TimePoint now) {
  const std::int64_t node = read_raw<internal_bus::command, "new_node">(frame);
  const bool is_meant = read_raw<internal_bus::command, "serial_number">(frame) == config_.serial_number;
  if (!is_meant || node < 1 || node > internal_bus::node_count_max) return CommandResult::bad_argument;
  config_.node = static_cast<std::uint8_t>(node);
  answer_ = {};  // an answer in progress belongs to the old number
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

TransferWanted Mmu::wants(TimePoint now) const {
  if (mode_ == UnitMode::asleep || !sampling_.is_due(now)) return TransferWanted::nothing;
  const bool has_missing = cell_sensors_.is_missing || board_sensors_.is_missing;
  return temperatures_.is_due(now) || has_missing ? TransferWanted::everything : TransferWanted::voltages;
}

MmuFrames Mmu::tick(TimePoint now, const FrontEndTransfer& transfer) {
  MmuFrames out;
  if (mode_ == UnitMode::unpowered) wait_for_power(now, transfer);
  if (mode_ >= UnitMode::asleep) return out;
  measure(now, transfer);
  update_balancing(now);
  update_mode(now);
  if (mode_ >= UnitMode::asleep) return out;
  send_responses(out);
  send_announcement(now, out);
  send_answer(now, out);
  return out;
}

void Mmu::measure(TimePoint now, const FrontEndTransfer& transfer) {
  const bool has_sensors = wants(now) == TransferWanted::everything;
  if (!sampling_.take(now)) return;
  temperatures_.take(now);
  const FrontEndReading reading = read(transfer);
  has_crc_errors_ = has_crc_errors_ || reading.damaged_groups > 0;
  counts_.damaged_groups += reading.damaged_groups;
  if (has_sensors) {
    note_sensors(now, reading.cell_sensors, config_.temperature_sensor_count, cell_sensors_);
    note_sensors(now, reading.board_sensors, config_.board_sensor_count, board_sensors_);
    judge_board(now);
    if (reading.cell_sensors) heat_.check(cell_sensors_.temperature_dC, config_.alarm_temperature_dC);
  }
  if (reading.supplies) {
    module_mV_ = reading.supplies->module_mV;
    module_taken_at_ = now;
    supply_.note(reading.supplies->external_mV, module_mV_);
  }
  if (reading.diagnosis) note_diagnosis(now, *reading.diagnosis);
  note_cells(now, reading);
}

void Mmu::note_diagnosis(TimePoint now, const DiagnosisReading& diagnosis) {
  diagnosis_read_at_ = now;
  is_self_test_ok_ = diagnosis.self_test_ok;
  open_wires_ = static_cast<CellMask>(diagnosis.open_wires & first_cells(config_.cell_count));
  reports_front_end_faults_ = diagnosis.faults.has_value();
  if (!diagnosis.faults) return;
  front_end_faults_.supply_low = front_end_faults_.supply_low || diagnosis.faults->supply_low;
  front_end_faults_.thermal_shutdown = front_end_faults_.thermal_shutdown || diagnosis.faults->thermal_shutdown;
}

/// A cell next to an open wire reads any voltage that the wire drifts to: it counts as not measured.
void Mmu::note_cells(TimePoint now, const FrontEndReading& reading) {
  const unsigned at_open_wire = open_wires_ | (static_cast<unsigned>(open_wires_) << 1U);
  const auto trusted = static_cast<CellMask>(first_cells(config_.cell_count) & ~at_open_wire);
  const CellSampler::Step step = sampler_.add({.cell_voltage_uV = reading.cell_voltage_uV,
                                               .arrived = reading.arrived_cells,
                                               .measured = static_cast<CellMask>(reading.converted_cells & trusted)},
                                              now);
  if (step != CellSampler::Step::average_complete) return;
  const CellReading renewed = sampler_.renewed_average();
  protection_.check(renewed);
  imbalance_.check(renewed);
  if (balancing_.is_round()) balancing_.stop(round_bound_.check(renewed, balancing_.switches()));
  has_voltages_ = has_voltages_ || renewed.exists();
}

void Mmu::note_sensors(TimePoint now, const std::optional<ThermistorReadings>& readings, std::size_t fitted,
                       Sensors& sensors) const {
  sensors.is_missing = !readings.has_value();
  if (!readings && now - sensors.taken_at <= temperature_age_max) return;
  if (readings) sensors.taken_at = now;
  for (std::size_t sensor = 0; sensor < sensors.temperature_dC.size(); ++sensor) {
    SignalValue& value = sensors.temperature_dC[sensor];
    value = not_known(sensor < fitted ? Validity::unknown : Validity::not_fitted);
    if (readings && sensor < fitted) {
      value = temperature_dC(config_.thermistor_curve, readings->input[sensor], readings->reference);
    }
  }
}

/// A hot board remains hot while it cannot be measured: a broken wire is no sign of cooling.
void Mmu::judge_board(TimePoint now) {
  const auto& sensors = board_sensors_.temperature_dC;
  const std::int32_t threshold_dC = board_temperature_limit_dC_ - (is_board_too_hot_ ? board_hysteresis_dC : 0);
  const bool is_hot = std::any_of(sensors.begin(), sensors.end(), [threshold_dC](const SignalValue& one) {
    return one.is_valid() && one.value > threshold_dC;
  });
  is_board_known_ = std::all_of(sensors.begin(), sensors.end(), [](const SignalValue& one) {
    return one.is_valid() || one.validity == Validity::not_fitted;
  });
  if (is_hot && !is_board_too_hot_) board_hot_since_ = now;
  is_board_too_hot_ = is_hot || (is_board_too_hot_ && !is_board_known_);
}

// --- supply, balancing, mode ----------------------------------------------------------------------------------------

/// The module was without power in the meantime: it starts again.
void Mmu::wait_for_power(TimePoint now, const FrontEndTransfer& transfer) {
  if (!sampling_.take(now)) return;
  const FrontEndReading reading = read(transfer);
  if (!reading.supplies) return;
  supply_.note(reading.supplies->external_mV, reading.supplies->module_mV);
  if (supply_.in_use() != SupplyInUse::none) restart(now);
}

bool Mmu::is_master_alive(TimePoint now) const {
  return now - polled_at_ < master_silence_max;
}

bool Mmu::is_supply_known(TimePoint now) const {
  return module_taken_at_ && now - *module_taken_at_ <= age_max;
}

bool Mmu::is_diagnosis_known(TimePoint now) const {
  return diagnosis_read_at_ && now - *diagnosis_read_at_ <= age_max;
}

/// A front end without current data has not passed.
bool Mmu::is_self_test_passed(TimePoint now) const {
  return is_self_test_ok_ && is_diagnosis_known(now) && is_supply_known(now);
}

bool Mmu::is_alarm_given(TimePoint now) const {
  const bool measures = mode_ < UnitMode::asleep && measured_cells(now) != 0;
  return !measures || protection_.overvoltage() != 0 || heat_.has_failed() || front_end_faults_.thermal_shutdown;
}

/// Cells with a voltage that could be sent now.
CellMask Mmu::measured_cells(TimePoint now) const {
  const CellReading& latest = sampler_.latest();
  return static_cast<CellMask>(latest.measured & latest.taken_since(now - age_max));
}

/// Cells that may be bled: those that are measured, by a front end that passed its self-test.
CellMask Mmu::bleedable_cells(TimePoint now) const {
  return is_self_test_passed(now) ? measured_cells(now) : CellMask{0};
}

bool Mmu::may_balance_alone(TimePoint now) const {
  return mode_ == UnitMode::autonomous && autonomous_balancing_allowed_ && protection_.undervoltage() == 0 &&
         is_self_test_passed(now);
}

CellMask Mmu::worth_a_round(TimePoint now) const {
  return static_cast<CellMask>(imbalance_.cells() & measured_cells(now) & ~protection_.failed() &
                               ~progress_.hopeless());
}

/// Reasons to use the module's own energy: time left, checks at rest that are not finished, or cells that wait for the
/// board to cool.
bool Mmu::has_balancing_to_do(TimePoint now) const {
  const bool is_too_hot_for_long = is_board_too_hot_ && now - board_hot_since_ >= cooling_time_max;
  if (!is_board_known_ || is_too_hot_for_long) return false;
  const bool is_looking = !imbalance_.is_decided() || worth_a_round(now) != 0;
  return balancing_.has_work() || (may_balance_alone(now) && is_looking);
}

void Mmu::balance_alone(TimePoint now) {
  if (!may_balance_alone(now)) return balancing_.stop_round();
  if (balancing_.has_work() || is_board_too_hot_ || !is_board_known_) return;
  const CellReading at_rest = sampler_.renewed_average();
  const auto above = static_cast<CellMask>(worth_a_round(now) & at_rest.measured);
  const CellMask cells = round_bound_.begin(progress_.begin_round(above, at_rest), at_rest);
  if (cells != 0) balancing_.start_round(cells);
}

void Mmu::update_balancing(TimePoint now) {
  balancing_.stop(static_cast<CellMask>(protection_.failed() | ~bleedable_cells(now)));
  if (supply_.in_use() == SupplyInUse::external && !is_master_alive(now)) balancing_.stop();
  balance_alone(now);
  balancing_.update(now, is_board_too_hot_ || !is_board_known_);
  imbalance_.note_switches(balancing_.switches() != 0);
}

/// The module is quiet when nothing is left to send: its own last frame must not wake it.
void Mmu::update_mode(TimePoint now) {
  const bool has_told_all = answer_.left == 0 && responses_.empty();
  const UnitMode next = next_mode(mode_, {.has_voltages = has_voltages_,
                                          .is_master_alive = is_master_alive(now) || is_listening_,
                                          .supply = supply_.in_use(),
                                          .has_listened_in_vain = is_listening_ && now >= listens_until_,
                                          .is_sleep_ordered = is_sleep_ordered_,
                                          .is_quiet = has_told_all && now >= sleeps_at_,
                                          .has_balancing_to_do = has_balancing_to_do(now)});
  if (next != mode_) enter(next, now);
}

/// An autonomous module uses only its own observations: the checks at rest and the progress of rounds start again.
void Mmu::enter(UnitMode mode, TimePoint now) {
  if (mode_ == UnitMode::autonomous) balancing_.stop_round();
  mode_ = mode;
  if (mode_ == UnitMode::autonomous) {
    imbalance_ = {};
    progress_ = {};
  }
  if (mode_ == UnitMode::going_to_sleep) sleeps_at_ = now + falling_asleep_time;
  if (mode_ < UnitMode::asleep) return;
  balancing_.stop();
  is_announcement_due_ = false;
}

// --- transmission ----------------------------------------------------------------------------------------------------

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
  if (!is_announcement_due_ || now < announces_at_ || mode_ == UnitMode::going_to_sleep) return;
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
    case Part::module: row = &internal_bus::module, frame = make_module(now); break;
    case Part::ident: row = &internal_bus::ident, frame = make_ident(); break;
  }
  BMU_ASSERT(row != nullptr);
  seal(*row, answer_.counter, frame);
  return frame;
}

/// The two "since the last STATUS" flags are sent once.
CanFrame Mmu::make_status(TimePoint now) {
  const bool has_sensor_fault =
      std::any_of(cell_sensors_.temperature_dC.begin(), cell_sensors_.temperature_dC.end(), is_unreadable) ||
      std::any_of(board_sensors_.temperature_dC.begin(), board_sensors_.temperature_dC.end(), is_unreadable);
  const bool is_on_external = supply_.in_use() == SupplyInUse::external && is_supply_known(now);
  const Duration age = answer_.cells.exists() ? now - answer_.cells.oldest() : Duration::max();
  const bool is_age_known = age <= age_max;

  CanFrame frame = make_frame(internal_bus::status, config_.node);
  write<internal_bus::status, "mode">(frame, static_cast<std::int64_t>(on_the_wire(mode_)));
  write<internal_bus::status, "supply">(frame, !is_on_external);
  write<internal_bus::status, "balancing">(frame, balancing_.switches() != 0);
  write<internal_bus::status, "cell_count">(frame, config_.cell_count);
  write<internal_bus::status, "limits_not_set">(frame, !are_limits_set_);
  write<internal_bus::status, "temperature_sensor_fault">(frame, has_sensor_fault);
  write<internal_bus::status, "external_supply_low">(frame, supply_.is_external_low() || !is_supply_known(now));
  write<internal_bus::status, "restarted">(frame, is_restarted_);
  write<internal_bus::status, "board_too_hot">(frame, is_board_too_hot_);
  write<internal_bus::status, "open_cell_wire">(frame, open_wires_ != 0);
  write<internal_bus::status, "self_test_failed">(frame, !is_self_test_passed(now));
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
    encode_signal(internal_bus::temp_1.signals[sensor], as_told(cell_sensors_.temperature_dC[sensor]), frame.data);
  }
  return frame;
}

CanFrame Mmu::make_temp_2() const {
  CanFrame frame = make_frame(internal_bus::temp_2, config_.node);
  encode_signal(internal_bus::temp_2.signals[0], as_told(cell_sensors_.temperature_dC[3]), frame.data);
  for (std::size_t sensor = 0; sensor < mmu_board_temperatures; ++sensor) {
    SignalValue value = board_sensors_.temperature_dC[sensor];
    if (is_unreadable(value)) value = not_known(Validity::sensor_fault);  // one code for open and shorted
    encode_signal(internal_bus::temp_2.signals[1 + sensor], value, frame.data);
  }
  return frame;
}

/// A fault that was detected is reported until it is cleared, regardless of later data of the front end.
CanFrame Mmu::make_module(TimePoint now) const {
  const bool has_front_end_fault = front_end_faults_.supply_low || front_end_faults_.thermal_shutdown;
  const bool has_report = reports_front_end_faults_ && is_diagnosis_known(now);
  const auto minutes_left = std::chrono::ceil<std::chrono::minutes>(balancing_.longest_time_left());
  CanFrame frame = make_frame(internal_bus::module, config_.node);
  write<internal_bus::module, "module_voltage_mV">(frame, is_supply_known(now) ? known(module_mV_) : not_known());
  write<internal_bus::module, "balancing_cells">(frame, balancing_.switches());
  write<internal_bus::module, "open_wire_cells">(frame, open_wires_);
  write<internal_bus::module, "front_end_faults_reported">(frame, has_report || has_front_end_fault);
  write<internal_bus::module, "front_end_supply_low">(frame, front_end_faults_.supply_low);
  write<internal_bus::module, "front_end_thermal_shutdown">(frame, front_end_faults_.thermal_shutdown);
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
