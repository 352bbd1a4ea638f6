#include "daemon/core/modules/module_setup.hpp"

#include <utility>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

using internal_bus::Operation;

CanFrame command_frame(std::uint8_t node, Operation operation) {
  CanFrame frame = make_frame(internal_bus::command, node);
  write<internal_bus::command, "operation">(frame, static_cast<std::int64_t>(operation));
  return frame;
}

bool is_about_board(SetupStage stage) {
  return stage == SetupStage::board_needed || stage == SetupStage::board_asked;
}

}  // namespace

void ModuleSetup::init(const CoreConfig& config, std::uint8_t first_counter) {
  module_count_ = config.modules.size();
  undervoltage_uV_ = config.limits.cell_undervoltage.open;
  overvoltage_uV_ = config.limits.cell_overvoltage.open;
  board_limit_dC_ = config.module_board_limit_dC;
  first_stage_ = are_modules_ours(config) ? SetupStage::needed : SetupStage::done;
  slots_.fill({.stage = first_stage_, .counter = first_counter});
  broadcast_counter_ = first_counter;
}

void ModuleSetup::start_over() {
  for (Slot& slot : slots_) {
    slot.stage = first_stage_;
    slot.is_mode_told = slot.is_mode_asked = false;
    slot.autonomous_since = {};
  }
}

SetupStage ModuleSetup::observe_status(std::size_t module_index, const ModuleStatus& said, TimePoint at) {
  Slot& slot = slots_[module_index];
  const bool is_autonomous = said.mode == internal_bus::Mode::autonomous;
  if (!is_autonomous) slot.autonomous_since = {};
  if (is_autonomous && slot.autonomous_since == TimePoint{}) slot.autonomous_since = at;
  if (said.restarted) slot.is_mode_told = slot.is_mode_asked = false;
  // A configured module that reports otherwise has restarted and has lost its settings. One that was never configured
  // in this session may hold the limits of another pack.
  const bool is_past_limits = slot.stage == SetupStage::done || is_about_board(slot.stage);
  if (said.restarted || (is_past_limits && said.limits_not_set)) {
    slot.stage = SetupStage::needed;
  } else if (slot.stage == SetupStage::told && !said.limits_not_set) {
    slot.stage = board_limit_dC_ ? SetupStage::board_needed : SetupStage::done;
  }
  if (slot.stage == SetupStage::done) slot.is_refused = false;
  return slot.stage;
}

bool ModuleSetup::observe_response(std::size_t module_index, const CanFrame& frame) {
  Slot& slot = slots_[module_index];
  const std::int64_t operation = read_raw<internal_bus::response, "operation">(frame);
  const bool is_done =
      read_raw<internal_bus::response, "result">(frame) == static_cast<std::int64_t>(internal_bus::CommandResult::done);
  if (slot.is_mode_asked && operation == static_cast<std::int64_t>(Operation::set_mode)) {
    slot.is_mode_asked = false;
    slot.is_mode_told = is_done;
    return false;
  }
  const bool is_board = slot.stage == SetupStage::board_asked;
  const Operation asked = is_board ? Operation::set_board_temperature_limit : Operation::set_limits;
  const bool is_ours = (slot.stage == SetupStage::asked || is_board) && operation == static_cast<std::int64_t>(asked);
  if (!is_ours) return false;
  if (is_done) {
    slot.stage = is_board ? SetupStage::done : SetupStage::told;
    if (is_board) slot.is_refused = false;
    return false;
  }
  // Sent again after setup_retry: a refusal "in this mode" may end by itself.
  return !std::exchange(slot.is_refused, true);
}

CanFrame ModuleSetup::command_for(std::uint8_t node, Slot& slot) const {
  CanFrame frame;
  if (is_about_board(slot.stage)) {
    frame = command_frame(node, Operation::set_board_temperature_limit);
    write<internal_bus::command, "board_temperature_limit_dC">(frame, *board_limit_dC_);
    slot.stage = SetupStage::board_asked;
  } else {
    frame = command_frame(node, Operation::set_limits);
    write<internal_bus::command, "undervoltage_limit_uV">(frame, undervoltage_uV_);
    write<internal_bus::command, "overvoltage_limit_uV">(frame, overvoltage_uV_);
    slot.stage = SetupStage::asked;
  }
  seal(internal_bus::command, slot.counter++, frame);
  return frame;
}

bool ModuleSetup::is_mode_due(const Slot& slot, const ModeWish& mode, TimePoint now) {
  if (slot.stage != SetupStage::done || !mode.may_tell) return false;
  const bool is_stuck = slot.autonomous_since != TimePoint{} && now - slot.autonomous_since >= mode_retry;
  const bool is_news = !slot.is_mode_told || slot.is_allowed != mode.is_autonomous_balancing_allowed;
  const bool is_too_soon = slot.mode_asked_at != TimePoint{} && now - slot.mode_asked_at < mode_retry;
  return (is_news || is_stuck) && !is_too_soon;
}

CanFrame ModuleSetup::mode_command(std::uint8_t node, const ModeWish& mode, TimePoint now, Slot& slot) {
  CanFrame frame = command_frame(node, Operation::set_mode);
  write<internal_bus::command, "mode">(frame, static_cast<std::int64_t>(internal_bus::Mode::normal));
  write<internal_bus::command, "autonomous_balancing_allowed">(frame, mode.is_autonomous_balancing_allowed ? 1 : 0);
  slot.is_mode_told = false;
  slot.is_mode_asked = true;
  slot.is_allowed = mode.is_autonomous_balancing_allowed;
  slot.mode_asked_at = now;
  seal(internal_bus::command, slot.counter++, frame);
  return frame;
}

FixedVector<CanFrame, setup_commands_per_tick> ModuleSetup::step(TimePoint now, const ModuleTable& modules,
                                                                 const ModeWish& mode, CommandTurns& turns) {
  FixedVector<CanFrame, setup_commands_per_tick> frames;
  for (std::size_t index = 0; index < module_count_ && frames.size() < setup_commands_per_tick; ++index) {
    Slot& slot = slots_[index];
    const ModuleRecord& module = modules.modules()[index];
    const bool is_new = slot.stage == SetupStage::needed || slot.stage == SetupStage::board_needed;
    const bool is_due = is_new || (slot.stage != SetupStage::done && now - slot.asked_at >= setup_retry);
    const bool is_mode = !is_due && is_mode_due(slot, mode, now);
    if (!(is_due || is_mode) || !module.status.is_valid() || !turns.is_free(index, now)) continue;
    turns.note_sent(index, now);
    if (is_mode) {
      frames.push_back(mode_command(module.config.node, mode, now, slot));
      continue;
    }
    frames.push_back(command_for(module.config.node, slot));
    slot.asked_at = now;
  }
  return frames;
}

CanFrame ModuleSetup::clear_faults() {
  CanFrame frame = command_frame(0, Operation::clear_faults);
  seal(internal_bus::command, broadcast_counter_++, frame);
  return frame;
}

CanFrame ModuleSetup::stop_balancing() {
  CanFrame frame = command_frame(0, Operation::stop_balancing);
  seal(internal_bus::command, broadcast_counter_++, frame);
  return frame;
}

CanFrame ModuleSetup::sleep() {
  CanFrame frame = command_frame(0, Operation::set_mode);
  write<internal_bus::command, "mode">(frame, static_cast<std::int64_t>(internal_bus::Mode::going_to_sleep));
  seal(internal_bus::command, broadcast_counter_++, frame);
  return frame;
}

CanFrame ModuleSetup::set_node(std::uint32_t serial_number, std::uint8_t node) {
  CanFrame frame = command_frame(0, Operation::set_node);
  write<internal_bus::command, "new_node">(frame, node);
  write<internal_bus::command, "serial_number">(frame, serial_number);
  seal(internal_bus::command, broadcast_counter_++, frame);
  return frame;
}

bool ModuleSetup::is_complete() const {
  for (std::size_t index = 0; index < module_count_; ++index) {
    if (slots_[index].stage != SetupStage::done) return false;
  }
  return module_count_ > 0;
}

}  // namespace bmu
