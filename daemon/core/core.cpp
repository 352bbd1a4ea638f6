#include "daemon/core/core.hpp"

#include <algorithm>
#include <utility>

namespace bmu {

namespace {

/// CAN_ERR_* classes of the kernel that change what we may believe.
constexpr std::uint32_t error_class_bus_off = 0x040;
constexpr std::uint32_t error_class_restarted = 0x100;

/// How long after a shut-down command we wait for the contacts' word before leaving anyway.
constexpr Duration shut_down_patience = 500ms;

std::array<bool, 4> contacts_of(const PduState& pdu) {
  return {pdu.main_positive_closed, pdu.main_negative_closed, pdu.precharge_closed, pdu.charge_closed};
}

/// Any input that can withdraw permission says no.
bool says_no(const PduState& pdu) {
  return !pdu.estop_1_released || !pdu.estop_2_released || !pdu.interlock_closed || !pdu.insulation_monitor_ok ||
         pdu.opened_by_timeout;
}

}  // namespace

Core::Core(const CoreConfig& config, TimePoint started_at)
    : config_(config),
      started_at_(started_at),
      view_began_at_(started_at),
      next_tick_(started_at),
      check_(config.sensor.little_endian ? internal_bus::catalogue_little_endian_sensor : internal_bus::catalogue,
             ReceiveCheck::Role::master) {
  modules_.init(config_);
  counter_.init(config_);
  contactor_watch_.init(started_at);
  poll_.init(config_.poll, started_at);
  setup_.init(config_);
  reporter_.init(started_at);
}

// --- observe
// ----------------------------------------------------------------------------------------------------------

Urgency Core::observe(const Observation& observation) {
  return std::visit([&](const auto& what) { return take(observation.at, what); }, observation.what);
}

Urgency Core::take(TimePoint at, const FrameReceived& what) {
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
  const Measured<PduState> pdu_before = sensors_.pdu;
  sensors_.observe(*checked.message, frame, at, config_.sensor);
  if (checked.message->base_id == internal_bus::pdu_status.base_id) {
    if (pdu_before.is_valid()) note_pdu_counter(frame.data[6]);
    pdu_counter_ = frame.data[6];
    pdu_words_lost_ = false;
    const PduState& before = pdu_before.value;
    const PduState& now = sensors_.pdu.value;
    const bool request_fell =
        (before.vehicle_on && !now.vehicle_on) || (before.charger_connected && !now.charger_connected);
    const bool contact_moved = contacts_of(before) != contacts_of(now);
    return says_no(now) || request_fell || contact_moved || flags_.pdu_restarted ? Urgency::decide_now
                                                                                 : Urgency::can_wait;
  }
  if (checked.message->base_id != internal_bus::sensor_current.base_id) return Urgency::can_wait;
  const Measured<std::int32_t>& current = sensors_.current_mA;
  if (current.taken_at != at) return Urgency::can_wait;  // the result was none
  counter_.observe(current, sensors_.pack_voltage_mV);
  const bool crosses = current.value >= config_.limits.discharge_overcurrent.open ||
                       -std::int64_t{current.value} >= config_.limits.charge_overcurrent.open;
  return crosses ? Urgency::decide_now : Urgency::can_wait;
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
  if ((what.classes & error_class_bus_off) != 0) is_bus_off_ = true;
  if ((what.classes & error_class_restarted) != 0) is_bus_off_ = false;
  if (was_bus_off == is_bus_off_) return Urgency::can_wait;
  update_bus_state(at);
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint at, const CommandGiven& what) {
  switch (what.command) {
    case Command::clear_faults: clear_ours_ = clear_modules_ = true; break;
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
  sensors_ = {};
  setup_.start_over();
  check_.forget_counters();
  request_.lose_sight();
}

// --- decide
// -----------------------------------------------------------------------------------------------------------

Decisions Core::decide(TimePoint now) {
  Decisions out;
  ++ticks_;
  check_loop_gap(now);
  decided_at_ = now;
  pack_ = summarise(modules_, sensors_, config_, now);
  seen_complete_ = seen_complete_ || (pack_.is_complete() && pack_.is_sensed() && pdu_fresh(now));
  const Measured<std::int32_t> average_uV{pack_.cell_voltage_uV.average, now,
                                          pack_.cell_voltage_uV.is_complete() ? Validity::valid : Validity::unknown};
  if (counter_.update(now, !outputs_.any_contactor(), pack_.current_mA, average_uV)) {
    events_.push({.id = EventId::soc_started, .at = now, .number = counter_.state().soc_permille});
  }
  follow_request(now);
  watch_contactors(now);
  evaluate_faults(now);
  grant_permission(now);
  refuse_vain_request(now);
  step_contactors(now);
  limits_ = evaluate_limits(pack_, config_,
                            {.is_connected = sequence_.phase == Phase::closed && permission_.may_stay_closed,
                             .zero_is_demanded = demands_zero_current(faults_),
                             .before = limits_});
  send_contactor_command(now, out);
  send_polls(now, out);
  send_report(now, out);
  out.is_shut_down = end_shut_down(now);
  events_.move_to(out);
  out.outputs = outputs_;
  out.wake_at = advance_tick(now);
  return out;
}

/// Deadlines advance by the period, so an early tick between two of them moves nothing.
TimePoint Core::advance_tick(TimePoint now) {
  if (next_tick_ <= now) next_tick_ += tick_period;
  if (next_tick_ <= now) next_tick_ = now + tick_period;  // we were late by more than one; no burst to catch up
  return next_tick_;
}

void Core::check_loop_gap(TimePoint now) {
  const bool is_gap = decided_at_ != TimePoint{} && now - decided_at_ > loop_gap_max;
  if (!is_gap) return;
  events_.push({.id = EventId::loop_gap, .at = now, .number = to_ms(now - decided_at_)});
  flags_.loop_gap_seen = true;
  start_over(now);
}

void Core::follow_request(TimePoint now) {
  if (!pdu_fresh(now)) return request_.lose_sight();
  if (!request_.follow(sensors_.pdu.value, !outputs_.any_contactor(), now)) return;
  events_.push({.id = request_.is_present() ? EventId::close_requested : EventId::close_request_over, .at = now});
}

void Core::watch_contactors(TimePoint now) {
  flags_.contactors_disobey = pdu_fresh(now) && contactor_watch_.disobeys(sensors_.pdu, config_.contactors, now);
  flags_.closing_is_commanded = outputs_.any_contactor();
  flags_.command_not_on_bus = !command_link_.is_on_bus(now);
  flags_.closed_since = sequence_.phase == Phase::closed ? sequence_.entered_at : TimePoint{};
}

void Core::evaluate_faults(TimePoint now) {
  if (std::exchange(clear_ours_, false)) note_fault_changes(faults_.clear_latched(), now);
  note_fault_changes(faults_.update(fault_inputs(now)), now);
  // Seen once is enough; the fault memory remembers from here.
  flags_.precharge_failed = false;
  flags_.foreign_master_seen = false;
  flags_.loop_gap_seen = false;
  flags_.frames_lost_seen = false;
  flags_.pdu_restarted = false;
}

void Core::grant_permission(TimePoint now) {
  permission_ = evaluate_permission({.now = now,
                                     .is_shutting_down = shutting_down_,
                                     .internal_bus_up = flags_.internal_bus_up,
                                     .pdu_fresh = pdu_fresh(now),
                                     .inputs_healthy = inputs_healthy(now),
                                     .modules_set_up = setup_.is_complete(),
                                     .commands_are_on_bus = command_link_.is_on_bus(now),
                                     .contacts_settled = contactor_watch_.is_settled(),
                                     .contactor_closed_though_open = pdu_fresh(now) && !outputs_.any_contactor() &&
                                                                     sensors_.pdu.value.any_contactor_closed(),
                                     .complete_cycles = modules_.complete_cycles(),
                                     .locked_out_until = locked_out_until_},
                                    pack_, faults_);
}

void Core::refuse_vain_request(TimePoint now) {
  const bool is_waiting = request_.is_present() && sequence_.phase == Phase::open && !permission_.may_close;
  if (!is_waiting) return;
  const auto& blockers = permission_.blockers;
  const bool has_fault = std::find(blockers.begin(), blockers.end(), Blocker::fault) != blockers.end();
  if (!has_fault && now - request_.since() < close_patience) return;
  request_.drop();
  last_refusal_ = {.has_happened = true, .at = now, .blocker = has_fault ? Blocker::fault : blockers[0]};
  events_.push({.id = EventId::close_refused, .at = now, .number = static_cast<std::int64_t>(last_refusal_.blocker)});
}

/// The pack voltage of a precharge is the higher one of the sensor's and the sum of the cells, and only while they
/// agree: a sensor that has lost its ground shows two voltages that agree with each other.
SequenceInputs Core::sequence_inputs(TimePoint now) const {
  const Measured<std::int32_t>& sum = pack_.cell_voltage_sum_mV;
  const Measured<std::int32_t>& pack = pack_.pack_voltage_mV;
  const std::int64_t apart_mV = std::int64_t{sum.value} - pack.value;
  const std::int64_t allowed_mV = config_.limits.pack_voltage_mismatch.open;
  const bool voltages_agree = sum.is_valid() && apart_mV < allowed_mV && apart_mV > -allowed_mV;
  const bool is_open = sequence_.phase == Phase::open;
  return {.now = now,
          .close_wanted = request_.is_present(),
          .close_permitted = is_open ? permission_.may_close : permission_.may_stay_closed,
          .may_advance = permission_.may_advance,
          .contacts_settled = contactor_watch_.is_settled(),
          .is_measured = pack_.is_sensed() && voltages_agree,
          .measured_at = std::min({pack.taken_at, pack_.link_voltage_mV.taken_at, pack_.current_mA.taken_at}),
          .pack_mV = std::max(pack.value, sum.value),
          .link_mV = pack_.link_voltage_mV.value,
          .current_mA = pack_.current_mA.value};
}

void Core::step_contactors(TimePoint now) {
  const SequenceState before = sequence_;
  const SequenceStep result = step(before, sequence_inputs(now), config_.contactors);
  sequence_ = result.state;
  if (result.outputs != outputs_) outputs_changed_at_ = now;
  contactor_watch_.command(result.outputs, now);
  outputs_ = result.outputs;
  if (sequence_.phase == before.phase) return;
  events_.push({.id = EventId::phase_changed, .at = now, .phase_from = before.phase, .phase_to = sequence_.phase});
  if (before.phase == Phase::precharge) {
    record_precharge(now, before.entered_at, sequence_.phase == Phase::main_positive);
  }
  if (sequence_.phase == Phase::open) record_opening(now, before.phase, result.precharge_failed);
}

void Core::record_precharge(TimePoint now, TimePoint began_at, bool was_successful) {
  last_precharge_ = {.has_run = true,
                     .was_successful = was_successful,
                     .ended_at = now,
                     .took = now - began_at,
                     .pack_mV = pack_.pack_voltage_mV.value,
                     .link_mV = pack_.link_voltage_mV.value,
                     .current_mA = pack_.current_mA.value};
  if (was_successful) events_.push({.id = EventId::precharge_done, .at = now, .number = to_ms(now - began_at)});
}

void Core::record_opening(TimePoint now, Phase from, bool precharge_failed) {
  OpeningRecord record{.at = now, .from = from, .current_mA = pack_.current_mA};
  const FaultRow* fault = nullptr;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = faults_.state(row.id);
    if (!demands_opening(row, state, pack_, now)) continue;
    if (fault == nullptr || state.suspected_since < faults_.state(fault->id).suspected_since) fault = &row;
  }
  if (shutting_down_) {
    record.cause = OpeningCause::shut_down;
  } else if (fault != nullptr) {
    const FaultState& state = faults_.state(fault->id);
    record.cause = OpeningCause::fault;
    record.fault = fault->id;
    record.reading = state.confirmed;
    record.threshold = state.threshold;
    record.suspected_since = state.suspected_since;
    record.confirmed_at = state.confirmed_at;
  } else if (precharge_failed) {
    flags_.precharge_failed = true;  // a fault from the next tick on
    record.cause = OpeningCause::fault;
    record.fault = FaultId::precharge_failed;
    record.reading = {true, pack_.link_voltage_mV.value, {}, pack_.link_voltage_mV.taken_at};
    record.suspected_since = record.confirmed_at = now;
  } else if (!request_.is_present()) {
    record.cause = OpeningCause::request_over;
  } else {
    record.cause = OpeningCause::permission;
    record.blocker = permission_.blockers.empty() ? Blocker::fault : permission_.blockers[0];
  }
  last_opening_ = record;
  const bool was_asked_for = record.cause == OpeningCause::request_over;
  if (!was_asked_for) request_.drop();  // what opened for a reason closes for a new wish only
  locked_out_until_ = now + (was_asked_for ? reclose_pause : reclose_lockout);
  events_.push({.id = EventId::opened,
                .at = now,
                .fault = record.fault,
                .reading = record.reading,
                .threshold = record.threshold,
                .phase_from = from,
                .cause = record.cause});
}

void Core::send_contactor_command(TimePoint now, Decisions& out) {
  if (!command_link_.is_due(now, outputs_changed_at_ == now)) return;
  command_link_.note_sent(command_counter_, now);
  send(Port::internal, contactor_command_frame(outputs_, command_counter_), out);
  ++command_counter_;
}

void Core::send_polls(TimePoint now, Decisions& out) {
  if (command_link_.is_stuck(now)) return;
  if (std::exchange(clear_modules_, false)) send(Port::internal, setup_.clear_faults(), out);
  const Poll poll = poll_.step(now, identities_known());
  if (poll.is_due) {
    modules_.begin_cycle(now, poll.wants);
    check_.note_sent(poll.frame);
    send(Port::internal, poll.frame, out);
  }
  for (const CanFrame& command : setup_.step(now, modules_)) {
    check_.note_sent(command);
    send(Port::internal, command, out);
  }
}

void Core::send_report(TimePoint now, Decisions& out) {
  if (ports_share_bus_ && command_link_.is_stuck(now)) return;
  const std::optional<CanFrame> frame = reporter_.step(now, vehicle_view(now), config_.vehicle);
  if (frame.has_value()) send(Port::vehicle, *frame, out);
}

void Core::send(Port port, const CanFrame& frame, Decisions& out) {
  const GateVerdict verdict = judge_output(port, frame,
                                           {.vehicle_base_id = config_.vehicle.base_id,
                                            .may_stay_closed = permission_.may_stay_closed,
                                            .decided = outputs_});
  if (verdict != GateVerdict::pass) {
    ++gate_refusals_;
    events_.push({.id = EventId::gate_refused, .at = decided_at_, .port = port, .number = frame.id});
    return;
  }
  if (!ports_[static_cast<std::size_t>(port)].is_up) return;
  ++ports_[static_cast<std::size_t>(port)].frames_sent;
  out.frames.push_back({port, frame});
}

// --- what they ask
// ----------------------------------------------------------------------------------------------------

void Core::note_fault_changes(const FaultChanges& changes, TimePoint now) {
  using Kind = FaultChange::Kind;
  constexpr std::array event_of{EventId::fault_warned, EventId::fault_warning_over, EventId::fault_confirmed,
                                EventId::fault_cause_gone, EventId::fault_cleared};
  for (const FaultChange& change : changes) {
    const FaultState& state = faults_.state(change.id);
    const bool is_warning = change.kind == Kind::warned || change.kind == Kind::warning_over;
    const Thresholds thresholds = thresholds_of(row_of(change.id), config_.limits);
    events_.push({.id = event_of[static_cast<std::size_t>(change.kind)],
                  .at = now,
                  .fault = change.id,
                  .reading = is_warning ? state.warning : state.confirmed,
                  .threshold = is_warning ? thresholds.warn : thresholds.open});
  }
}

FaultInputs Core::fault_inputs(TimePoint now) const {
  return {.now = now,
          .config = &config_,
          .pack = &pack_,
          .modules = &modules_,
          .sensors = &sensors_,
          .flags = flags_,
          .has_started = has_started(now)};
}

VehicleView Core::vehicle_view(TimePoint now) const {
  VehicleView view{.state = vehicle_state(),
                   .uptime = now - started_at_,
                   .pack = &pack_,
                   .limits = &limits_,
                   .charge = &charge(),
                   .capacity_uAs = config_.cell.capacity_uAs};
  for (const FaultRow& row : fault_table()) {
    if (row.dtc == 0 || !faults_.state(row.id).is_present()) continue;
    (view.dtc_1 == 0 ? view.dtc_1 : view.dtc_2) = row.dtc;
  }
  return view;
}

vehicle_bus::State Core::vehicle_state() const {
  const bool has_fault = std::any_of(fault_table().begin(), fault_table().end(), [this](const FaultRow& row) {
    return row.reaction != Reaction::warn && faults_.state(row.id).is_present();
  });
  if (has_fault) return vehicle_bus::State::fault;
  if (sequence_.phase != Phase::closed) return vehicle_bus::State::off_open;
  const PduState& pdu = sensors_.pdu.value;
  if (pdu.charger_connected) return vehicle_bus::State::charger_closed;
  return pdu.vehicle_on ? vehicle_bus::State::on_closed : vehicle_bus::State::off_closed;
}

bool Core::pdu_fresh(TimePoint now) const {
  return sensors_.pdu.is_usable(now, config_.ages.pdu_status);
}

bool Core::inputs_healthy(TimePoint now) const {
  return pdu_fresh(now) && !says_no(sensors_.pdu.value);
}

bool Core::has_started(TimePoint now) const {
  return seen_complete_ || (flags_.internal_bus_up && now - view_began_at_ >= start_grace);
}

bool Core::identities_known() const {
  return std::all_of(modules_.modules().begin(), modules_.modules().end(),
                     [](const ModuleRecord& module) { return module.identity.is_valid(); });
}

/// Leaves when the contacts have confirmed, in a word younger than the command; or when patience is over.
bool Core::end_shut_down(TimePoint now) {
  if (!shutting_down_) return false;
  const Measured<PduState>& pdu = sensors_.pdu;
  const bool is_confirmed = pdu_fresh(now) && pdu.taken_at > shut_down_at_ && !pdu.value.any_contactor_closed();
  if (is_confirmed || now - shut_down_at_ < shut_down_patience) return is_confirmed;
  if (!std::exchange(shut_down_told_, true)) events_.push({.id = EventId::shut_down_unconfirmed, .at = now});
  return true;
}

}  // namespace bmu
