#include "daemon/core/module_setup.hpp"

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

CanFrame limits_command(std::uint8_t node, std::int32_t undervoltage_uV, std::int32_t overvoltage_uV,
                        std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::command, node);
  write<internal_bus::command, "operation">(frame, static_cast<std::int64_t>(internal_bus::Operation::set_limits));
  write<internal_bus::command, "undervoltage_limit_uV">(frame, undervoltage_uV);
  write<internal_bus::command, "overvoltage_limit_uV">(frame, overvoltage_uV);
  seal(internal_bus::command, counter, frame);
  return frame;
}

}  // namespace

void ModuleSetup::init(const CoreConfig& config) {
  module_count_ = config.modules.size();
  undervoltage_uV_ = config.limits.cell_undervoltage.open;
  overvoltage_uV_ = config.limits.cell_overvoltage.open;
  slots_.fill({});
}

void ModuleSetup::start_over() {
  for (Slot& slot : slots_) slot.stage = SetupStage::needed;
}

SetupStage ModuleSetup::observe_status(std::size_t module_index, bool limits_not_set) {
  Slot& slot = slots_[module_index];
  // A module that was set up and says otherwise has restarted. One that we never told may hold another pack's limits.
  if (slot.stage == SetupStage::done && limits_not_set) slot.stage = SetupStage::needed;
  if (slot.stage == SetupStage::told && !limits_not_set) slot.stage = SetupStage::done;
  return slot.stage;
}

SetupStage ModuleSetup::observe_response(std::size_t module_index, const CanFrame& frame) {
  Slot& slot = slots_[module_index];
  const bool is_ours =
      slot.stage == SetupStage::asked && read_raw<internal_bus::response, "operation">(frame) ==
                                             static_cast<std::int64_t>(internal_bus::Operation::set_limits);
  if (!is_ours) return slot.stage;
  const bool is_done =
      read_raw<internal_bus::response, "result">(frame) == static_cast<std::int64_t>(internal_bus::CommandResult::done);
  slot.stage = is_done ? SetupStage::told : SetupStage::refused;
  return slot.stage;
}

FixedVector<CanFrame, setup_commands_per_tick> ModuleSetup::step(TimePoint now, const ModuleTable& modules) {
  FixedVector<CanFrame, setup_commands_per_tick> frames;
  for (std::size_t index = 0; index < module_count_ && frames.size() < setup_commands_per_tick; ++index) {
    Slot& slot = slots_[index];
    const ModuleRecord& module = modules.modules()[index];
    const bool is_due =
        slot.stage == SetupStage::needed || (slot.stage != SetupStage::done && now - slot.asked_at >= setup_retry);
    if (!is_due || !module.status.is_valid()) continue;
    frames.push_back(limits_command(module.config.node, undervoltage_uV_, overvoltage_uV_, slot.counter++));
    slot.stage = SetupStage::asked;
    slot.asked_at = now;
  }
  return frames;
}

CanFrame ModuleSetup::clear_faults() {
  CanFrame frame = make_frame(internal_bus::command, 0);
  write<internal_bus::command, "operation">(frame, static_cast<std::int64_t>(internal_bus::Operation::clear_faults));
  seal(internal_bus::command, broadcast_counter_++, frame);
  return frame;
}

CanFrame ModuleSetup::sleep() {
  CanFrame frame = make_frame(internal_bus::command, 0);
  write<internal_bus::command, "operation">(frame, static_cast<std::int64_t>(internal_bus::Operation::set_mode));
  write<internal_bus::command, "mode">(frame, static_cast<std::int64_t>(internal_bus::Mode::going_to_sleep));
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
