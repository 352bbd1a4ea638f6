#include "daemon/core/measurement/module_table.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// Frames of an answer follow each other immediately; after this time without one no module is sending.
constexpr Duration quiet_min = 5ms;

// One bit for each frame of an answer.
constexpr std::uint32_t status_bit = 1U << 0;
constexpr std::uint32_t first_cells_bit = 1U << 1;  // CELLS_1; the others follow
constexpr std::uint32_t temp_1_bit = 1U << 5;
constexpr std::uint32_t temp_2_bit = 1U << 6;
constexpr std::uint32_t module_bit = 1U << 7;
constexpr std::uint32_t ident_bit = 1U << 8;

std::uint32_t answer_bits(const ModuleConfig& module, const PollWants& wants) {
  std::uint32_t bits = 0;
  if (wants.status) bits |= status_bit;
  if (wants.cells) {
    const unsigned blocks = (module.cell_count + internal_bus::cells_per_frame - 1U) / internal_bus::cells_per_frame;
    for (unsigned block = 0; block < blocks; ++block) bits |= first_cells_bit << block;
  }
  if (wants.temperatures) bits |= temp_1_bit | temp_2_bit;
  if (wants.module) bits |= module_bit;
  if (wants.identity) bits |= ident_bit;
  return bits;
}

std::uint16_t next_of_ten(std::uint16_t frames, bool is_damaged) {
  constexpr unsigned last_ten = 0x3FF;
  return static_cast<std::uint16_t>(((unsigned{frames} << 1U) | (is_damaged ? 1U : 0U)) & last_ten);
}

ModuleStatus status_of(const CanFrame& frame) {
  return {
      .mode = static_cast<internal_bus::Mode>(read_raw<internal_bus::status, "mode">(frame)),
      .on_module_supply = read_raw<internal_bus::status, "supply">(frame) != 0,
      .is_balancing = read_raw<internal_bus::status, "balancing">(frame) != 0,
      .cell_count = static_cast<std::uint8_t>(read_raw<internal_bus::status, "cell_count">(frame)),
      .limits_not_set = read_raw<internal_bus::status, "limits_not_set">(frame) != 0,
      .temperature_sensor_fault = read_raw<internal_bus::status, "temperature_sensor_fault">(frame) != 0,
      .restarted = read_raw<internal_bus::status, "restarted">(frame) != 0,
      .external_supply_low = read_raw<internal_bus::status, "external_supply_low">(frame) != 0,
      .board_too_hot = read_raw<internal_bus::status, "board_too_hot">(frame) != 0,
      .open_cell_wire = read_raw<internal_bus::status, "open_cell_wire">(frame) != 0,
      .self_test_failed = read_raw<internal_bus::status, "self_test_failed">(frame) != 0,
      .front_end_crc_errors = read_raw<internal_bus::status, "front_end_crc_errors">(frame) != 0,
      .undervoltage_cells = static_cast<std::uint16_t>(read_raw<internal_bus::status, "undervoltage_cells">(frame)),
      .overvoltage_cells = static_cast<std::uint16_t>(read_raw<internal_bus::status, "overvoltage_cells">(frame)),
      .voltage_age_ms = read<internal_bus::status, "cell_voltage_age_ms">(frame),
  };
}

FrontEndStatus front_end_of(const CanFrame& frame) {
  return {.is_reported = read_raw<internal_bus::module, "front_end_faults_reported">(frame) != 0,
          .is_supply_low = read_raw<internal_bus::module, "front_end_supply_low">(frame) != 0,
          .is_shut_down = read_raw<internal_bus::module, "front_end_thermal_shutdown">(frame) != 0};
}

}  // namespace

void ModuleTable::init(const CoreConfig& config) {
  foreign_ = config.foreign.driver;
  modules_.clear();
  index_of_node_.fill(no_module);
  for (const ModuleConfig& module : config.modules) {
    BMU_ASSERT(module.node >= 1 && module.node <= internal_bus::node_count_max);
    BMU_ASSERT(module.cell_count >= 1 && module.cell_count <= internal_bus::cells_per_module_max);
    index_of_node_[module.node] = static_cast<std::uint8_t>(modules_.size());
    modules_.push_back({.config = module});
  }
}

/// As many modules as in the configuration, each still with its node.
bool ModuleTable::are_fields_possible() const {
  std::size_t nodes = 0;
  for (const std::uint8_t index : index_of_node_) {
    if (index != no_module) ++nodes;
  }
  const auto is_in_place = [this](const ModuleRecord& module) { return find(module.config.node) == &module; };
  return modules_.size() == nodes && std::all_of(modules_.begin(), modules_.end(), is_in_place);
}

const ModuleRecord* ModuleTable::find(std::uint8_t node) const {
  const std::uint8_t index = node < index_of_node_.size() ? index_of_node_[node] : no_module;
  return index == no_module ? nullptr : &modules_[index];
}

void ModuleTable::observe(const MessageSpec& message, std::uint8_t node, const CanFrame& frame, TimePoint at) {
  if (find(node) == nullptr) return;
  const std::uint8_t index = index_of_node_[node];
  ModuleRecord& module = modules_[index];
  module.last_answer_at = at;
  module.damaged_frames = next_of_ten(module.damaged_frames, false);
  std::uint32_t answered = 0;
  switch (message.base_id) {
    case internal_bus::status.base_id:
      take_status(module, frame, at);
      answered = status_bit;
      break;
    case internal_bus::cells_1.base_id:
    case internal_bus::cells_2.base_id:
    case internal_bus::cells_3.base_id:
    case internal_bus::cells_4.base_id: {
      const unsigned block = (unsigned{message.base_id} - internal_bus::cells_1.base_id) /
                             (internal_bus::cells_2.base_id - internal_bus::cells_1.base_id);
      take_cells(module, block, frame, polled_at_[index]);
      answered = first_cells_bit << block;
      break;
    }
    case internal_bus::temp_1.base_id:
    case internal_bus::temp_2.base_id:
      take_temperatures(index, message, frame, at);
      answered = message.base_id == internal_bus::temp_1.base_id ? temp_1_bit : temp_2_bit;
      break;
    case internal_bus::module.base_id:
      module.module_voltage_mV = measured(read<internal_bus::module, "module_voltage_mV">(frame), polled_at_[index]);
      module.balancing_cells = static_cast<std::uint16_t>(read_raw<internal_bus::module, "balancing_cells">(frame));
      module.open_wire_cells = static_cast<std::uint16_t>(read_raw<internal_bus::module, "open_wire_cells">(frame));
      module.switches_read_at = polled_at_[index];
      module.front_end = {front_end_of(frame), at, Validity::valid};
      answered = module_bit;
      break;
    case internal_bus::ident.base_id:
      take_identity(module, frame, at);
      answered = ident_bit;
      break;
    default: break;  // RESPONSE is handled by module_setup
  }
  note_answer(index, answered, at);
}

void ModuleTable::take_status(ModuleRecord& module, const CanFrame& frame, TimePoint at) {
  module.status = {status_of(frame), at, Validity::valid};
  if (module.status.value.restarted && module.answers_complete > 0) ++module.restarts;
}

void ModuleTable::take_cells(ModuleRecord& module, std::size_t block, const CanFrame& frame, TimePoint polled_at) {
  const MessageSpec& row = *internal_bus::cells_rows[block];
  // STATUS is the first frame of an answer; the age of the voltages in it applies to the cells after it.
  const Measured<ModuleStatus>& said = module.status;
  if (!said.is_valid() || said.taken_at < polled_at) return;
  const SignalValue age_ms = said.value.voltage_age_ms;
  TimePoint taken_at = polled_at;
  if (age_ms.is_valid()) taken_at = std::min(taken_at, said.taken_at - std::chrono::milliseconds(age_ms.value));
  for (std::size_t slot = 0; slot < internal_bus::cells_per_frame; ++slot) {
    const std::size_t cell = block * internal_bus::cells_per_frame + slot;
    Measured<std::int32_t> voltage = measured(decode_signal(row.signals[slot], frame.data), taken_at);
    if (!age_ms.is_valid()) voltage.validity = Validity::unknown;
    module.cell_voltage_uV[cell] = voltage;
  }
}

void ModuleTable::take_temperatures(std::size_t index, const MessageSpec& message, const CanFrame& frame,
                                    TimePoint at) {
  ModuleRecord& module = modules_[index];
  std::array<JumpWatch, temperatures_per_module>& jumps = jumps_[index];
  // TEMP_1 holds cell sensors 1 to 3; TEMP_2 holds cell sensor 4, then the board sensors.
  const bool is_first = message.base_id == internal_bus::temp_1.base_id;
  const std::size_t cell_sensors = is_first ? 3 : 1;
  for (std::size_t slot = 0; slot < cell_sensors; ++slot) {
    const std::size_t sensor = (is_first ? 0 : 3) + slot;
    module.cell_temperature_dC[sensor] =
        jumps[sensor].take(measured(decode_signal(message.signals[slot], frame.data), at), polled_at_[index]);
  }
  if (is_first) return;
  for (std::size_t slot = 0; slot < internal_bus::board_temperatures_per_module; ++slot) {
    take_board(index, slot, measured(decode_signal(message.signals[1 + slot], frame.data), at), polled_at_[index]);
  }
}

void ModuleTable::take_board(std::size_t index, std::size_t slot, const Measured<std::int32_t>& told,
                             TimePoint asked_at) {
  ModuleRecord& module = modules_[index];
  module.board_temperature_dC[slot] = jumps_[index][cell_sensors_max + slot].take(told, asked_at);
  if (told.validity == Validity::not_fitted) return;
  module.fitted_boards = static_cast<std::uint8_t>(module.fitted_boards | (1U << slot));
}

void ModuleTable::take_identity(ModuleRecord& module, const CanFrame& frame, TimePoint at) const {
  const ModuleIdentity seen{
      .protocol_version = static_cast<std::uint8_t>(read_raw<internal_bus::ident, "protocol_version">(frame)),
      .cell_count = static_cast<std::uint8_t>(read_raw<internal_bus::ident, "cell_count">(frame)),
      .temperature_sensor_count =
          static_cast<std::uint8_t>(read_raw<internal_bus::ident, "temperature_sensor_count">(frame)),
      .serial_number = static_cast<std::uint32_t>(read_raw<internal_bus::ident, "serial_number">(frame)),
  };
  if (module.serial_number_known && module.serial_number != seen.serial_number) {
    module.rival_seen_at = at;
    module.rival_serial_number = module.serial_number;
  }
  module.serial_number_known = true;
  module.serial_number = seen.serial_number;
  module.identity = {seen, at, Validity::valid};
}

void ModuleTable::observe(const ModuleReport& report, TimePoint at) {
  if (find(report.node) == nullptr) return;
  const std::uint8_t index = index_of_node_[report.node];
  ModuleRecord& module = modules_[index];
  module.last_answer_at = at;
  module.damaged_frames = next_of_ten(module.damaged_frames, false);
  module.values_out_of_range +=
      values_out_of_range(report, module.config.cell_count, module.config.temperature_sensor_count);
  const TimePoint asked_at = question_for(index, report.parts, at);
  if (asked_at == TimePoint{}) return;  // no poll yet: the sample time is unknown
  take_report(index, report, asked_at);
  note_answer(index, is_too_soon(at) ? 0U : report.parts, at);
}

/// Time of the older of the last two polls that this answer may belong to.
TimePoint ModuleTable::question_for(std::size_t index, ModuleParts parts, TimePoint at) const {
  const bool is_owed_before = (owed_[index] & parts) != 0;
  return is_too_soon(at) || is_owed_before ? round_before_at_ : round_at_;
}

void ModuleTable::take_report(std::size_t index, const ModuleReport& report, TimePoint asked_at) {
  ModuleRecord& module = modules_[index];
  const auto says = [&report](ModulePart part) { return (report.parts & bit_of(part)) != 0; };
  if (says(ModulePart::status)) {
    const ModuleStatus said{.mode = internal_bus::Mode::normal,
                            .is_balancing = report.bleeding_cells != 0,
                            .cell_count = module.config.cell_count,
                            .voltage_age_ms = known(to_ms(foreign_->sample_age_max)),
                            .maker_errors = report.errors};
    module.status = {said, asked_at, Validity::valid};
    module.balancing_cells = report.bleeding_cells;
    module.switches_read_at = asked_at;
    if (!foreign_->tells_stack_voltage) module.module_voltage_mV = {0, asked_at, Validity::not_fitted};
  }
  if (says(ModulePart::voltage)) {
    module.module_voltage_mV = measured(report.stack_voltage_mV, asked_at - foreign_->sample_age_max);
  }
  take_cells_of(module, report, asked_at);
  if (says(ModulePart::temperatures)) take_temperatures_of(index, report, asked_at);
}

void ModuleTable::take_cells_of(ModuleRecord& module, const ModuleReport& report, TimePoint asked_at) const {
  for (std::size_t slot = 0; slot < report.cell_voltage_uV.size(); ++slot) {
    module.cell_voltage_uV[report.first_cell + slot] =
        measured(report.cell_voltage_uV[slot], asked_at - foreign_->sample_age_max);
  }
}

void ModuleTable::take_temperatures_of(std::size_t index, const ModuleReport& report, TimePoint asked_at) {
  for (std::size_t sensor = 0; sensor < report.cell_temperature_dC.size(); ++sensor) {
    modules_[index].cell_temperature_dC[sensor] =
        jumps_[index][sensor].take(measured(report.cell_temperature_dC[sensor], asked_at), asked_at);
  }
  if (report.board_temperature_dC) take_board(index, 0, measured(*report.board_temperature_dC, asked_at), asked_at);
}

void ModuleTable::note_answer(std::size_t index, std::uint32_t answer_bits, TimePoint at) {
  heard_at_ = at;
  if ((expected_[index] & answer_bits) == 0) return;
  expected_[index] &= ~answer_bits;
  if (expected_[index] != 0) return;
  ModuleRecord& module = modules_[index];
  ++module.answers_complete;
  if (owed_[index] == 0) module.answer_times.add(at - cycle_began_at_);
  if (--modules_incomplete_ > 0 || is_in_doubt_) return;
  if (is_counted_) ++complete_cycles_;
  completed_at_ = cycle_began_at_;
}

void ModuleTable::note_missed() {
  if (modules_incomplete_ > 0) complete_cycles_ = 0;
  for (std::size_t index = 0; index < modules_.size(); ++index) {
    if (expected_[index] != 0) ++modules_[index].answers_missed;
  }
}

void ModuleTable::begin_cycle(TimePoint at, const PollWants& wants) {
  note_missed();
  for (std::size_t index = 0; index < modules_.size(); ++index) {
    expected_[index] = answer_bits(modules_[index].config, wants);
  }
  modules_incomplete_ = modules_.size();
  begin(at);
}

void ModuleTable::begin_round(TimePoint at, bool is_start) {
  note_missed();
  is_in_doubt_ = modules_incomplete_ > 0;
  for (std::size_t index = 0; index < modules_.size(); ++index) {
    owed_[index] = static_cast<ModuleParts>(expected_[index]);
    expected_[index] = is_start ? 0U : foreign_->parts_of(modules_[index].config.cell_count);
  }
  modules_incomplete_ = is_start ? 0 : modules_.size();
  round_before_at_ = round_at_;
  round_at_ = is_start ? TimePoint{} : at;
  begin(at);
}

/// Common part of a poll of all modules, of any manufacturer.
void ModuleTable::begin(TimePoint at) {
  asked_alone_.fill(false);
  heard_at_ = {};
  is_counted_ = true;
  polled_at_.fill(at);
  cycle_began_at_ = at;
}

void ModuleTable::begin_single(std::uint8_t node, TimePoint at) {
  if (find(node) != nullptr) polled_at_[index_of_node_[node]] = at;
}

const ModuleRecord* ModuleTable::next_silent(TimePoint now) const {
  if (heard_at_ == TimePoint{} || now - heard_at_ < quiet_min) return nullptr;
  for (std::size_t step = 0; step < modules_.size(); ++step) {
    const std::size_t index = (next_turn_ + step) % modules_.size();
    if (expected_[index] != 0 && !asked_alone_[index]) return &modules_[index];
  }
  return nullptr;
}

void ModuleTable::note_asked_alone(std::uint8_t node) {
  if (find(node) == nullptr) return;
  const std::size_t index = index_of_node_[node];
  asked_alone_[index] = true;
  next_turn_ = index + 1;
  ++modules_[index].asked_alone;
}

void ModuleTable::requalify() {
  complete_cycles_ = 0;
  is_counted_ = false;
}

void ModuleTable::note_rejected(std::uint8_t node, RejectReason reason) {
  if (find(node) != nullptr) ++modules_[index_of_node_[node]].rejected[static_cast<std::size_t>(reason)];
}

void ModuleTable::forget_identity(std::uint8_t node) {
  if (find(node) == nullptr) return;
  ModuleRecord& module = modules_[index_of_node_[node]];
  module.identity = {};
  module.serial_number_known = false;
  module.last_answer_at = {};  // set by the next answer from this node
}

std::uint8_t ModuleTable::node_in_doubt(TimePoint now) const {
  for (std::size_t index = 0; index < modules_.size(); ++index) {
    const auto& jumps = jumps_[index];
    const auto is_worth_it = [now](const JumpWatch& jump) { return jump.is_worth_asking(now); };
    if (std::any_of(jumps.begin(), jumps.end(), is_worth_it)) return modules_[index].config.node;
  }
  return 0;
}

PollWants ModuleTable::outstanding(std::uint8_t node) const {
  const std::uint32_t bits = find(node) == nullptr ? 0 : expected_[index_of_node_[node]];
  constexpr std::uint32_t cells_bits = 0xFU * first_cells_bit;
  return {.status = (bits & status_bit) != 0,
          .cells = (bits & cells_bits) != 0,
          .temperatures = (bits & (temp_1_bit | temp_2_bit)) != 0,
          .module = (bits & module_bit) != 0,
          .identity = (bits & ident_bit) != 0};
}

void ModuleTable::note_conflict(std::uint8_t node, TimePoint at) {
  if (find(node) == nullptr) return;
  const std::size_t index = index_of_node_[node];
  ModuleRecord& module = modules_[index];
  const bool was_contradicted = module.conflict_seen_at != TimePoint{};
  if (was_contradicted && module.conflict_seen_at >= polled_at_[index]) return;  // the same answer
  if (was_contradicted && at - module.conflict_seen_at <= conflict_memory) module.rival_seen_at = at;
  module.conflict_seen_at = at;
}

void ModuleTable::note_damaged(std::uint8_t node, TimePoint at) {
  if (find(node) == nullptr) return;
  ModuleRecord& module = modules_[index_of_node_[node]];
  module.damaged_frames = next_of_ten(module.damaged_frames, true);
  module.damaged_at = at;
}

void ModuleTable::forget_values() {
  for (ModuleRecord& module : modules_) {
    module.cell_voltage_uV.fill({});
    module.cell_temperature_dC.fill({});
    module.board_temperature_dC.fill({});
    module.module_voltage_mV = {};
    module.switches_read_at = {};
    module.status = {};
    module.identity = {};
    module.front_end = {};
    module.damaged_frames = 0;
  }
  jumps_ = {};
  round_at_ = {};
  round_before_at_ = {};
  owed_.fill(0);
  is_in_doubt_ = false;
  expected_.fill(0);
  complete_cycles_ = 0;
  completed_at_ = {};
  modules_incomplete_ = 0;
}

namespace {

bool is_beyond(const Measured<std::int32_t>& value, const LimitConfig& low, const LimitConfig& high) {
  return value.is_valid() && (value.value <= low.open || value.value >= high.open);
}

bool any_cell_beyond(const ModuleRecord& module, const LimitsConfig& limits) {
  return std::any_of(module.cell_voltage_uV.begin(), module.cell_voltage_uV.end(), [&](const auto& value) {
    return is_beyond(value, limits.cell_undervoltage, limits.cell_overvoltage);
  });
}

bool any_temperature_beyond(const ModuleRecord& module, const LimitsConfig& limits) {
  return std::any_of(module.cell_temperature_dC.begin(), module.cell_temperature_dC.end(), [&](const auto& value) {
    return is_beyond(value, limits.cell_undertemperature, limits.cell_overtemperature);
  });
}

bool has_front_end_fault(const FrontEndStatus& front_end) {
  return front_end.is_reported && (front_end.is_supply_low || front_end.is_shut_down);
}

}  // namespace

bool ModuleTable::any_beyond(const CheckedFrame& checked, const LimitsConfig& limits) const {
  const ModuleRecord& module = modules_[index_of_node_[checked.node]];
  const std::uint32_t id = checked.message->base_id;
  if (id == internal_bus::status.base_id) {
    return module.status.value.undervoltage_cells != 0 || module.status.value.overvoltage_cells != 0;
  }
  if (id == internal_bus::temp_1.base_id || id == internal_bus::temp_2.base_id) {
    return any_temperature_beyond(module, limits);
  }
  if (id == internal_bus::module.base_id) return has_front_end_fault(module.front_end.value);
  return any_cell_beyond(module, limits);
}

bool ModuleTable::any_beyond(std::uint8_t node, const LimitsConfig& limits) const {
  const ModuleRecord& module = modules_[index_of_node_[node]];
  return any_cell_beyond(module, limits) || any_temperature_beyond(module, limits);
}

}  // namespace bmu
