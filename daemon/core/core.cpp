#include "daemon/core/core.hpp"

#include <algorithm>
#include <utility>

namespace bmu {

namespace {

/// CAN_ERR_* classes of the kernel that change what we may believe.
constexpr std::uint32_t error_class_bus_off = 0x040;
constexpr std::uint32_t error_class_restarted = 0x100;
constexpr std::uint32_t error_class_controller = 0x004;
/// Bits of byte 1 behind error_class_controller.
constexpr std::uint8_t controller_passive = 0x30;
constexpr std::uint8_t controller_active = 0x40;

/// Of any configuration: what a state file asks for beyond is none of ours.
constexpr Duration lockout_max = 600s;

std::array<bool, 4> contacts_of(const PduState& pdu) {
  return {pdu.main_positive_closed, pdu.main_negative_closed, pdu.precharge_closed, pdu.charge_closed};
}

}  // namespace

Core::Core(const CoreConfig& config, TimePoint started_at)
    : config_(config),
      started_at_(started_at),
      view_began_at_(started_at),
      next_tick_(started_at),
      check_(config.sensor.little_endian ? internal_bus::catalogue_little_endian_sensor : internal_bus::catalogue,
             ReceiveCheck::Role::master) {
  sensors_.insulation_known_at = started_at;
  sequence_.entered_at = started_at;  // open since then, as far as anybody knows
  modules_.init(config_);
  counter_.init(config_);
  contactor_watch_.init(started_at);
  poll_.init(config_.poll, started_at);
  setup_.init(config_);
  reporter_.init(started_at);
  watchers_.overload.init(config_.current);
  watchers_.stuck.init(config_.cell);
  watchers_.steps.init(config_);
  guard_.init(config_.contactors);
  rest_.init(config_.rest);
  auxiliary_.init(config_.auxiliary);
}

void Core::restore(const PersistentState& state) {
  persistent_ = state;
  ledger_.restore(state.contactors);
  guard_.restore(state.closing.precharge);
  // How much of it has passed nobody knows.
  lockout_ = std::chrono::milliseconds{std::clamp<std::int64_t>(state.closing.lockout_ms, 0, to_ms(lockout_max))};
  locked_out_until_ = started_at_ + lockout_;
  for (const FaultRow& row : fault_table()) {
    const FaultRecord& record = state.faults[static_cast<std::size_t>(row.id)];
    if (!record.is_locked || row.latch == Latch::none) continue;
    const FreezeFrame frame = record.frame.value_or(FreezeFrame{});
    faults_.restore_lock(row.id, {record.frame.has_value(), frame.value, frame.element}, frame.threshold, started_at_);
  }
}

std::int64_t Core::unix_time_ms(TimePoint at) const {
  return is_clock_known_ ? to_ms(at.time_since_epoch() + clock_offset_) : 0;
}

// --- observe
// ----------------------------------------------------------------------------------------------------------

Urgency Core::observe(const Observation& observation) {
  return std::visit([&](const auto& what) { return take(observation.at, what); }, observation.what);
}

Urgency Core::take(TimePoint at, const FrameReceived& what) {
  // One interface for both buses tells every frame as internal. Our own come back as echoes, never here.
  const bool is_report = !what.frame.is_extended && what.frame.id - config_.vehicle.base_id < vehicle_message_count;
  if (is_report && (what.port == Port::vehicle || ports_share_bus_)) watchers_.bus.note_foreign_report(at);
  if (what.port != Port::internal) return Urgency::can_wait;  // nobody on the vehicle bus has a say yet
  const CheckedFrame checked = check_.check(what.frame);
  if (!checked.is_accepted) return take_rejected(checked, at);
  if (is_bus_off_) {
    is_bus_off_ = false;  // not every driver tells of a restart; a sound frame proves it
    update_bus_state(at);
  }
  return checked.message->sender == Sender::mmu ? take_module_frame(checked, what.frame, at)
                                                : take_sensor_frame(checked, what.frame, at);
}

Urgency Core::take_rejected(const CheckedFrame& checked, TimePoint at) {
  if (checked.reason == RejectReason::foreign_master) {
    flags_.foreign_master_seen = true;
    return Urgency::decide_now;
  }
  // A wrong length is no noise, which the bus itself would have caught, but a stranger or another firmware; what the
  // module owes is then missing, and that has a fault of its own.
  const bool is_damaged = checked.reason == RejectReason::wrong_crc;
  if (is_damaged && checked.message->sender == Sender::mmu) modules_.note_damaged(checked.node, at);
  const bool is_conflict = checked.reason == RejectReason::conflicting;
  if (is_conflict && checked.message->base_id == internal_bus::pdu_status.base_id) flags_.pdu_restarted = true;
  const bool is_rival = is_conflict && checked.message->sender == Sender::mmu;
  if (is_rival) modules_.note_conflict(checked.node, at);
  return is_conflict ? Urgency::decide_now : Urgency::can_wait;
}

Urgency Core::take_module_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  const std::uint32_t cycles_before = modules_.complete_cycles();
  const ModuleRecord* known = modules_.find(checked.node);
  if (known == nullptr) {
    check_.reject(frame, RejectReason::not_configured);
    watchers_.bus.note_unknown_module(checked.node, at);
    return Urgency::can_wait;
  }
  const bool was_identified = known->identity.is_valid();
  const std::size_t index = modules_.index_of(checked.node);
  if (checked.message->base_id == internal_bus::response.base_id) {
    const SetupStage before = setup_.stage(index);
    const bool refuses = setup_.observe_response(index, frame) == SetupStage::refused;
    if (refuses && before != SetupStage::refused) {
      events_.push({.id = EventId::module_refused_limits, .at = at, .number = checked.node});
    }
    return Urgency::can_wait;
  }
  modules_.observe(*checked.message, checked.node, frame, at);
  if (checked.message->base_id == internal_bus::status.base_id) {
    const SetupStage before = setup_.stage(index);
    const bool has_taken = setup_.observe_status(index, known->status.value.limits_not_set) == SetupStage::done;
    if (has_taken && before != SetupStage::done) {
      events_.push({.id = EventId::module_limits_set, .at = at, .number = checked.node});
    }
    if (known->status.value.restarted && seen_complete_) {
      events_.push({.id = EventId::module_restarted, .at = at, .number = checked.node});
    }
  }
  if (!was_identified && known->identity.is_valid()) {
    events_.push({.id = EventId::module_identified,
                  .at = at,
                  .reading = {.element = {.module_node = checked.node}},
                  .number = known->identity.value.serial_number});
  }
  const bool crosses = modules_.any_beyond(checked, config_.limits);
  const bool cycle_completed = modules_.complete_cycles() != cycles_before;
  return crosses || cycle_completed ? Urgency::decide_now : Urgency::can_wait;
}

Urgency Core::take_sensor_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  const bool had_word = sensors_.pdu_word.is_valid();
  const PduState before = sensors_.pdu.value;
  sensors_.observe(*checked.message, frame, at, config_);
  if (checked.message->base_id == internal_bus::pdu_status.base_id) {
    if (had_word) note_pdu_counter(frame.data[6]);
    pdu_counter_ = frame.data[6];
    pdu_words_lost_ = false;
    return flags_.pdu_restarted ? Urgency::decide_now : urgency_of(before, sensors_.pdu.value);
  }
  if (checked.message->base_id != internal_bus::sensor_current.base_id) return Urgency::can_wait;
  const Measured<std::int32_t>& current = sensors_.current_mA;
  if (current.taken_at != at) return Urgency::can_wait;  // the result was none
  counter_.observe(current, sensors_.pack_voltage_mV);
  watchers_.overload.observe(current);
  const bool crosses = current.value >= config_.limits.discharge_overcurrent.open ||
                       -std::int64_t{current.value} >= config_.limits.charge_overcurrent.open;
  return crosses ? Urgency::decide_now : Urgency::can_wait;
}

/// An input says no, a wish ended, or a contact moved.
Urgency Core::urgency_of(const PduState& before, const PduState& now) {
  const bool request_fell =
      (before.vehicle_on && !now.vehicle_on) || (before.charger_connected && !now.charger_connected);
  const bool contact_moved = contacts_of(before) != contacts_of(now);
  return !now.is_healthy() || request_fell || contact_moved ? Urgency::decide_now : Urgency::can_wait;
}

/// A unit that started anew counts from somewhere else. A few words may be lost in between, at 50 ms each.
void Core::note_pdu_counter(std::uint8_t counter) {
  constexpr std::uint8_t steps_max = 4;
  const auto steps = static_cast<std::uint8_t>(counter - pdu_counter_);
  if ((steps == 0 || steps > steps_max) && !pdu_words_lost_) flags_.pdu_restarted = true;
}

Urgency Core::take(TimePoint, const FrameEchoed& what) {
  const bool is_report = what.frame.id - config_.vehicle.base_id < vehicle_message_count;
  // One interface for both buses tells every frame as internal; the reports are the vehicle port's all the same.
  const Port port = is_report ? Port::vehicle : what.port;
  ++ports_[static_cast<std::size_t>(port)].frames_echoed;
  ports_share_bus_ = ports_share_bus_ || (is_report && what.port == Port::internal);
  if (port == Port::internal && what.frame.id == internal_bus::contactor_command.base_id) {
    command_link_.note_echo(what.frame.data[6]);
  }
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint, const SendFailed& what) {
  ++ports_[static_cast<std::size_t>(what.port)].sends_failed;
  const bool is_command = what.port == Port::internal && what.frame.id == internal_bus::contactor_command.base_id &&
                          !what.frame.is_extended;
  if (is_command) command_link_.note_failed();
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const PortChanged& what) {
  PortStatus& port = ports_[static_cast<std::size_t>(what.port)];
  if (port.is_up == what.is_up) return Urgency::can_wait;
  port.is_up = what.is_up;
  if (!what.is_up) ++port.times_down;
  events_.push({.id = what.is_up ? EventId::port_up : EventId::port_down, .at = at, .port = what.port});
  if (what.port != Port::internal) return Urgency::can_wait;
  is_bus_off_ = false;
  update_bus_state(at);
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint, const FramesLost& what) {
  ports_[static_cast<std::size_t>(what.port)].frames_lost += what.count;
  if (what.port != Port::internal) return Urgency::can_wait;
  flags_.frames_lost_seen = true;
  // A jump of the unit's counter then says nothing, whether its word came just before this or is still to come.
  flags_.pdu_restarted = false;
  pdu_words_lost_ = true;
  command_link_.note_echoes_lost();
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const BusErrorSeen& what) {
  ++ports_[static_cast<std::size_t>(what.port)].error_frames;
  if (what.port != Port::internal) return Urgency::can_wait;
  const bool was_bus_off = is_bus_off_;
  if ((what.classes & error_class_controller) != 0) {
    if ((what.controller & controller_passive) != 0) watchers_.bus.note_error_passive(true);
    if ((what.controller & controller_active) != 0) watchers_.bus.note_error_passive(false);
  }
  if ((what.classes & error_class_bus_off) != 0) {
    is_bus_off_ = true;
    watchers_.bus.note_bus_off(at);
  }
  if ((what.classes & error_class_restarted) != 0) is_bus_off_ = false;
  if (was_bus_off == is_bus_off_) return Urgency::can_wait;
  update_bus_state(at);
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint at, const CommandGiven& what) {
  switch (what.command) {
    case Command::clear_faults:
      clear_ours_ = clear_modules_ = true;
      clear_given_ = what;
      break;
    case Command::wake: rest_.wake(); break;
    case Command::shut_down:
      if (!shutting_down_) {
        shutting_down_ = true;
        shut_down_at_ = at;
        events_.push({.id = EventId::shutting_down, .at = at});
      }
      break;
  }
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint at, const WallClockSeen& what) {
  const Duration offset = std::chrono::milliseconds{what.unix_time_ms} - at.time_since_epoch();
  const Duration jump = offset > clock_offset_ ? offset - clock_offset_ : clock_offset_ - offset;
  flags_.clock_jumped = flags_.clock_jumped || (is_clock_known_ && jump >= clock_jump_min);
  is_clock_known_ = true;
  clock_offset_ = offset;
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint, const HealthSeen& what) {
  flags_.health = what.health;
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const LinesSeen& what) {
  const PduState before = sensors_.pdu.value;
  const bool fails = what.image.is_failed && !flags_.lines_failed;
  flags_.lines_failed = what.image.is_failed;
  sensors_.observe(what.image, at, config_);
  return fails ? Urgency::decide_now : urgency_of(before, sensors_.pdu.value);
}

/// Whenever the bus was away, what was known before says nothing about now.
void Core::update_bus_state(TimePoint at) {
  const bool is_up = ports_[static_cast<std::size_t>(Port::internal)].is_up && !is_bus_off_;
  if (is_up == flags_.internal_bus_up) return;
  flags_.internal_bus_up = is_up;
  command_link_.forget();
  start_over(at);
}

/// As after a start: nothing is known, and "not yet heard" is not "lost" for a while.
void Core::start_over(TimePoint at) {
  view_began_at_ = at;
  seen_complete_ = false;
  modules_.forget_values();
  sensors_ = {.insulation_known_at = at};
  watchers_.trend.forget();
  watchers_.stuck.forget();
  watchers_.steps.forget();
  setup_.start_over();
  check_.forget_counters();
  request_.lose_sight();
}

}  // namespace bmu
