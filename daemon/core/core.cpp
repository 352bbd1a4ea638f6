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

Core::Core(const CoreConfig& config, TimePoint started_at, std::uint8_t first_counter)
    : config_(config),
      started_at_(started_at),
      view_began_at_(started_at),
      next_tick_(started_at),
      check_(config.sensor.little_endian ? internal_bus::catalogue_little_endian_sensor : internal_bus::catalogue,
             ReceiveCheck::Role::master),
      command_counter_(first_counter) {
  sensors_.insulation_known_at = started_at;
  sequence_.entered_at = started_at;  // open since then, as far as anybody knows
  modules_.init(config_);
  counter_.init(config_);
  contactor_watch_.init(started_at);
  poll_.init(config_.poll, started_at, first_counter);
  pace_.init(config_.poll, started_at);
  configured_ages_ = config_.ages;
  setup_.init(config_, first_counter);
  balancing_.init(config_);
  estimate_.init(config_);
  charge_pause_.init(config_);
  cell_charges_.init(config_);
  reporter_.init(started_at);
  watchers_.overload.init(carried(config_));
  watchers_.stuck.init(config_.cell);
  watchers_.steps.init(config_);
  watchers_.roster.init(config_);
  watchers_.switches.init(config_);
  guard_.init(config_.contactors);
  rest_.init(config_.rest);
  auxiliary_.init(config_.auxiliary);
}

void Core::restore(const PersistentState& state) {
  persistent_ = state;
  ledger_.restore(state.contactors);
  guard_.restore(state.closing.precharge);
  watchers_.roster.restore(state.modules);
  estimate_.restore(state.soc);
  has_memory_ = true;
  former_totals_ = state.totals;
  cell_charges_.restore(state.cell_charges);
  const FormerBook former = cell_charges_.former();
  if (former != FormerBook::none) {
    events_.push({.id = EventId::former_charges, .at = started_at_, .number = static_cast<std::int64_t>(former)});
  }
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
  if (checked.message == nullptr) return Urgency::can_wait;
  const bool is_module = checked.message->sender == Sender::mmu;
  if (is_module) modules_.note_rejected(checked.node, checked.reason);
  // A wrong length is no noise, which the bus itself would have caught, but a stranger or another firmware; what the
  // module owes is then missing, and that has a fault of its own.
  const bool is_damaged = checked.reason == RejectReason::wrong_crc;
  if (is_damaged && is_module) modules_.note_damaged(checked.node, at);
  const bool is_conflict = checked.reason == RejectReason::conflicting;
  if (is_conflict && checked.message->base_id == internal_bus::pdu_status.base_id) flags_.pdu_restarted = true;
  if (is_conflict && is_module) {
    modules_.note_conflict(checked.node, at);
    const ModuleRecord* module = modules_.find(checked.node);
    const bool has_rival = module != nullptr && module->rival_seen_at == at;  // once may be chance
    if (has_rival) forget_cells_of(checked.node);
  }
  return is_conflict ? Urgency::decide_now : Urgency::can_wait;
}

Urgency Core::take_module_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  const std::uint32_t cycles_before = modules_.complete_cycles();
  const ModuleRecord* known = modules_.find(checked.node);
  if (known == nullptr) {
    take_stranger(checked, frame, at);
    return Urgency::can_wait;
  }
  const Measured<ModuleIdentity> identity_before = known->identity;
  const std::size_t index = modules_.index_of(checked.node);
  if (checked.message->base_id == internal_bus::status.base_id) broadcasts_.note_answer();
  if (checked.message->base_id == internal_bus::response.base_id) {
    turns_.note_response(index);
    const SetupStage before = setup_.stage(index);
    if (setup_.observe_response(index, frame)) {
      events_.push({.id = EventId::module_refused_limits, .at = at, .number = checked.node});
    }
    note_set_up(before, index, checked.node, at);
    const bool had_failed = balancing_.has_failed(index);
    const bool refuses_minutes =
        balancing_.observe_response(index, frame, at, watchers_.switches) == OrderStage::refused;
    if (refuses_minutes && !had_failed) {
      events_.push({.id = EventId::module_refused_balancing, .at = at, .number = checked.node});
    }
    return Urgency::can_wait;
  }
  modules_.observe(*checked.message, checked.node, frame, at);
  if (checked.message->base_id == internal_bus::status.base_id) note_status(index, *known, at);
  if (checked.message->base_id == internal_bus::ident.base_id) note_identity(*known, identity_before, at);
  const bool crosses = modules_.any_beyond(checked, config_.limits);
  const bool cycle_completed = modules_.complete_cycles() != cycles_before;
  return crosses || cycle_completed ? Urgency::decide_now : Urgency::can_wait;
}

/// What a module of another pack says is no measurement of ours; who it is helps to find out why it is here.
void Core::take_stranger(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  check_.reject(frame, RejectReason::not_configured);
  watchers_.bus.note_unknown_module(checked.node, at);
  watchers_.roster.observe_stranger(*checked.message, checked.node, frame, at);
  const StrangerRecord& stranger = watchers_.roster.stranger(checked.node);
  if (checked.message->base_id != internal_bus::ident.base_id) return;
  note_identity_for_assignment(checked.node, stranger.serial_number, at);
}

/// Whatever was learned of a module's cells, where they may be others now.
void Core::forget_cells_of(std::uint8_t node) {
  if (modules_.find(node) == nullptr) return;
  cell_charges_.forget_module(modules_.index_of(node));
  estimate_.forget_module(modules_.index_of(node));
  watchers_.steps.forget_module(node);
}

void Core::note_status(std::size_t index, const ModuleRecord& module, TimePoint at) {
  const SetupStage before = setup_.stage(index);
  static_cast<void>(setup_.observe_status(index, module.status.value, at));
  note_set_up(before, index, module.config.node, at);
  if (module.status.value.restarted && seen_complete_) {
    events_.push({.id = EventId::module_restarted, .at = at, .number = module.config.node});
  }
}

void Core::note_set_up(SetupStage before, std::size_t index, std::uint8_t node, TimePoint at) {
  if (before == SetupStage::done || setup_.stage(index) != SetupStage::done) return;
  events_.push({.id = EventId::module_limits_set, .at = at, .number = node});
}

void Core::note_identity(const ModuleRecord& module, const Measured<ModuleIdentity>& before, TimePoint at) {
  const std::uint32_t serial_number = module.identity.value.serial_number;
  const bool is_news = !before.is_valid() || before.value.serial_number != serial_number;
  note_identity_for_assignment(module.config.node, serial_number, at);
  if (!is_news) return;
  if (before.is_valid()) forget_cells_of(module.config.node);
  const Reading where{.element = {.module_node = module.config.node}};
  events_.push({.id = EventId::module_identified, .at = at, .reading = where, .number = serial_number});
  const KnownModule expected = watchers_.roster.finding(module, modules_, at).expected;
  if (!expected.is_known || expected.serial_number == serial_number) return;
  events_.push({.id = EventId::module_out_of_place,
                .at = at,
                .reading = where,
                .threshold = expected.serial_number,
                .number = serial_number});
}

/// From here on the module belongs on its new node, and on no other.
void Core::note_identity_for_assignment(std::uint8_t node, std::uint32_t serial_number, TimePoint at) {
  if (!assignment_.observe_identity(node, serial_number, at)) return;
  watchers_.bus.forget_unknown_module(watchers_.roster.assign(node, serial_number));
  keep_roster();
  forget_cells_of(assignment_.node_before());
  forget_cells_of(node);
  modules_.forget_identity(assignment_.node_before());
  if (modules_.find(node) != nullptr) setup_.start_over(modules_.index_of(node));
  events_.push({.id = EventId::module_given_node,
                .at = at,
                .reading = {.element = {.module_node = node}},
                .number = serial_number});
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
      clear_ours_ = true;
      broadcasts_.clear();
      clear_given_ = what;
      break;
    case Command::wake: rest_.wake(); break;
    case Command::accept_modules: accept_given_ = what; break;
    case Command::assign_node: assign_given_ = what; break;
    case Command::balancing_off: balancing_off_ = true; break;
    case Command::balancing_on: balancing_off_ = false; break;
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
  watchers_.switches.forget();
  balancing_.forget(at);
  waiting_orders_ = {};
  setup_.start_over();
  pace_.start_over(at);
  ages_slow_until_ = {};
  check_.forget_counters();
  request_.lose_sight();
}

}  // namespace bmu
