// What the core decides once a tick, in one fixed order, and what it remembers of it.
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "daemon/core/core.hpp"

namespace bmu {

namespace {

/// How long after a shut-down command, and after everything was commanded open, we wait for the contacts' word before
/// leaving anyway.
constexpr Duration shut_down_patience = 500ms;

/// So often it is looked at whether the estimate is worth a record.
constexpr Duration estimate_look_every = 5s;

/// As elements count contactors.
constexpr std::uint8_t main_positive_number = 1 + static_cast<std::uint8_t>(ContactorId::main_positive);

}  // namespace

Decisions Core::decide(TimePoint now) {
  Decisions out;
  ++ticks_;
  check_loop_gap(now);
  decided_at_ = now;
  pack_ = summarise(modules_, sensors_, config_, now);
  seen_complete_ = seen_complete_ || (pack_.is_complete() && pack_.is_sensed() && pdu_fresh(now));
  estimate(now);
  follow_request(now);
  follow_pace(now);
  follow_modules(now);
  follow_rest(now);
  watch_contactors(now);
  evaluate_faults(now);
  grant_permission(now);
  refuse_vain_request(now);
  step_contactors(now);
  set_limits(now);
  step_auxiliary(now);
  send_contactor_command(now, out);
  send_polls(now, out);
  balance(now, out);
  send_broadcasts(now, out);
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
  flags_.tick_was_late = decided_at_ != TimePoint{} && now - next_tick_ > tick_late;
  const bool is_gap = decided_at_ != TimePoint{} && now - decided_at_ > loop_gap_max;
  if (!is_gap) return;
  events_.push({.id = EventId::loop_gap, .at = now, .number = to_ms(now - decided_at_)});
  flags_.loop_gap_seen = true;
  start_over(now);
}

void Core::estimate(TimePoint now) {
  watchers_.trend.update(modules_);
  watchers_.stuck.update(modules_, pack_.current_mA);
  watchers_.steps.update(modules_, sensors_, pack_);
  watchers_.switches.update(modules_);
  follow_estimate(now);
  keep_estimate(now);
  follow_charges(now);
  keep_charges(now);
}

void Core::follow_estimate(TimePoint now) {
  const bool has_begun = estimate_.update({.now = now,
                                           .unix_time_ms = unix_time_ms(now),
                                           .is_open = !outputs_.any_contactor(),
                                           .modules = &modules_,
                                           .sensors = &sensors_,
                                           .pack = &pack_,
                                           .charge = &counter_.state(),
                                           .bled_uAs = watchers_.switches.bled_uAs()});
  if (!has_begun) return;
  events_.push({.id = EventId::soc_started, .at = now, .number = estimate_.told_permille()});
  estimate_kept_at_ = now - estimate_look_every;  // the record of a former life is no longer the last word
}

/// When a cell has moved far enough, at most every few seconds: a file is written for it. And once more at the end,
/// when nothing can flow any more.
void Core::keep_estimate(TimePoint now) {
  const bool is_last = shutting_down_ && !outputs_.any_contactor() && !has_kept_last_;
  if (now - estimate_kept_at_ < estimate_look_every && !is_last) return;
  has_kept_last_ = has_kept_last_ || is_last;
  estimate_kept_at_ = now;
  keep_totals(is_last);
  SocRecords records;
  if (!estimate_.record(records) || (!is_last && !is_worth_recording(persistent_.soc, records))) return;
  records.unix_time_ms = unix_time_ms(now);
  records.is_last = has_kept_last_;
  persistent_.soc = records;
  touch_persistent();
}

void Core::keep_totals(bool is_last) {
  const std::optional<PackTotals> all = totals();
  if (!all || *all == persistent_.totals) return;
  if (!is_last && !is_worth_recording(persistent_.totals, *all, config_.cell.capacity_uAs)) return;
  persistent_.totals = *all;
  touch_persistent();
}

void Core::follow_charges(TimePoint now) {
  const FormerBook before = cell_charges_.former();
  cell_charges_.update({.now = now,
                        .unix_time_ms = unix_time_ms(now),
                        .is_open = !outputs_.any_contactor(),
                        .is_bleeding = watchers_.switches.is_any_on() || watchers_.switches.is_any_told(),
                        .modules = &modules_,
                        .pack = &pack_,
                        .charge = &counter_.state(),
                        .bled_uAs = watchers_.switches.bled_uAs()});
  const FormerBook former = cell_charges_.former();
  if (former == before) return;
  events_.push({.id = EventId::former_charges, .at = now, .number = static_cast<std::int64_t>(former)});
}

/// At most every `record_every`, and once more at the end: a file is written for it.
void Core::keep_charges(TimePoint now) {
  constexpr Duration look_every = 1s;
  const bool is_first = charges_kept_at_ == TimePoint{};
  const bool is_last = shutting_down_ && charges_kept_at_ < shut_down_at_;
  const bool is_due = (is_first || now - charges_kept_at_ >= record_every) && now - charges_looked_at_ >= look_every;
  if (!is_due && !is_last) return;
  charges_looked_at_ = now;
  CellChargeRecords records;
  if (!cell_charges_.record(records) || !is_worth_recording(persistent_.cell_charges, records)) return;
  charges_kept_at_ = now;
  persistent_.cell_charges = records;
  touch_persistent();
}

void Core::follow_rest(TimePoint now) {
  const PduState& pdu = sensors_.pdu.value;
  const bool knows_lines = pdu_fresh(now);
  const bool has_changed = rest_.step({.now = now,
                                       .is_undervoltage = faults_.state(FaultId::cell_undervoltage).is_present() ||
                                                          faults_.state(FaultId::cell_deep_discharge).is_present(),
                                       .is_open = !outputs_.any_contactor(),
                                       .has_complete_view = pack_.is_complete(),
                                       .resume_button = knows_lines && pdu.resume_button,
                                       .charger_connected = knows_lines && pdu.charger_connected,
                                       .vehicle_on = knows_lines && pdu.vehicle_on});
  if (!has_changed) return;
  events_.push({.id = EventId::rest_changed, .at = now, .number = static_cast<std::int64_t>(rest_.phase())});
  if (rest_.is_resting()) broadcasts_.sleep();
  if (!rest_.is_resting()) broadcasts_.end_sleep();
  // Asleep nothing is known, awake nothing yet. The unit goes on talking in between, and who woke the pack by asking to
  // close has asked.
  const SensorTable kept = sensors_;
  const CloseRequest asked = request_;
  start_over(now);
  request_ = asked;
  sensors_.pdu = kept.pdu;
  sensors_.pdu_word = kept.pdu_word;
  sensors_.lines = kept.lines;
}

void Core::follow_request(TimePoint now) {
  if (!pdu_fresh(now)) return request_.lose_sight();
  if (!request_.follow(sensors_.pdu.value, !outputs_.any_contactor(), now)) return;
  events_.push({.id = request_.is_present() ? EventId::close_requested : EventId::close_request_over, .at = now});
}

void Core::watch_contactors(TimePoint now) {
  const Disobedience disobedience =
      pdu_fresh(now) ? contactor_watch_.disobeys(sensors_.pdu, config_.contactors, now) : Disobedience{};
  flags_.contactor_not_following = disobedience.not_following;
  link_shows_weld_ = link_shows_weld_ && !faults_.state(FaultId::contactor_welded).is_present();
  flags_.contactor_welded = link_shows_weld_ ? main_positive_number : disobedience.welded;
  flags_.closing_is_commanded = outputs_.any_contactor();
  flags_.command_not_on_bus = config_.contactors.has_pdu && !command_link_.is_on_bus(now);
  const bool is_closed = sequence_.phase == Phase::closed;
  flags_.closed_since = is_closed ? sequence_.entered_at : TimePoint{};
  const auto keep_since = [now](TimePoint& since, bool holds) {
    if (!holds) since = {};
    if (holds && since == TimePoint{}) since = now;
  };
  keep_since(flags_.open_since, !outputs_.any_contactor());
  keep_since(flags_.charge_forbidden_since, is_closed && forbids(faults_, Concerns::charge));
  keep_since(flags_.discharge_forbidden_since, is_closed && forbids(faults_, Concerns::discharge));
  // A pack at a charger stands, whether or not its key is on.
  const bool is_at_charger = !pdu_fresh(now) || sensors_.pdu.value.charger_connected;
  flags_.is_driving = is_closed && request_.is_by_vehicle() && !is_at_charger;
}

void Core::evaluate_faults(TimePoint now) {
  mode_before_ = mode();
  if (std::exchange(clear_ours_, false)) note_fault_changes(faults_.clear_latched(clear_given_.authority), now);
  note_fault_changes(faults_.update(fault_inputs(now)), now);
  // Seen once is enough; the fault memory remembers from here.
  flags_.precharge_failure = PrechargeFailure::none;
  flags_.clock_jumped = false;
  flags_.foreign_master_seen = false;
  flags_.loop_gap_seen = false;
  flags_.frames_lost_seen = false;
  flags_.pdu_restarted = false;
}

void Core::grant_permission(TimePoint now) {
  permission_ = evaluate_permission({.now = now,
                                     .wish = wish(),
                                     .is_shutting_down = shutting_down_,
                                     .is_resting = rest_.is_resting(),
                                     .internal_bus_up = flags_.internal_bus_up,
                                     .pdu_fresh = pdu_fresh(now),
                                     .inputs_healthy = inputs_healthy(now),
                                     .insulation_known = insulation_known(now),
                                     .modules_set_up = setup_.is_complete(),
                                     .commands_are_on_bus = !flags_.command_not_on_bus,
                                     .contacts_settled = contactor_watch_.is_settled(),
                                     .contactor_closed_though_open = pdu_fresh(now) && !outputs_.any_contactor() &&
                                                                     sensors_.pdu.value.any_contactor_closed(),
                                     .link_follows_though_open = link_follows_though_open(),
                                     .precharge_is_cool = guard_.is_cool(),
                                     .complete_cycles = modules_.complete_cycles(),
                                     .locked_out_until = locked_out_until_},
                                    pack_, faults_);
}

void Core::refuse_vain_request(TimePoint now) {
  const bool is_waiting = request_.is_present() && sequence_.phase == Phase::open && !permission_.may_close;
  if (!is_waiting) return;
  const auto& blockers = permission_.blockers;
  if (!is_vain(blockers, now - request_.since(), guard_.is_retrying())) return;
  request_.drop();
  last_refusal_ = {.has_happened = true, .at = now, .blocker = has_fault(blockers) ? Blocker::fault : blockers[0]};
  events_.push({.id = EventId::close_refused, .at = now, .number = static_cast<std::int64_t>(last_refusal_.blocker)});
}

/// The pack voltage of a precharge is the higher one of the sensor's and the sum of the cells, and only while they
/// agree.
SequenceInputs Core::sequence_inputs(TimePoint now) const {
  const Measured<std::int32_t>& sum = pack_.cell_voltage_sum_mV;
  const Measured<std::int32_t>& pack = pack_.pack_voltage_mV;
  return {.now = now,
          .close_wanted = wants_close(),
          .close_permitted = is_permitted(permission_, sequence_.phase),
          .may_advance = permission_.may_advance,
          .contacts_settled = contactor_watch_.is_settled(),
          .charge_wanted = request_.is_by_charger(),
          .charge_permitted = permission_.may_charge,
          .resistor_is_hot = guard_.is_overheated(),
          .is_current_known = pack_.current_mA.is_valid(),
          .current_mA = pack_.current_mA.value,
          .current_at = pack_.current_mA.taken_at,
          .is_measured = pack_.is_sensed() && voltages_agree(sum, pack, config_.limits.pack_voltage_mismatch.open),
          .measured_at = std::min({pack.taken_at, pack_.link_voltage_mV.taken_at, pack_.current_mA.taken_at}),
          .pack_mV = std::max(pack.value, sum.value),
          .link_mV = pack_.link_voltage_mV.value};
}

void Core::step_contactors(TimePoint now) {
  const SequenceState before = sequence_;
  const SequenceInputs inputs = sequence_inputs(now);
  guard_.update(now, before.phase == Phase::precharge, inputs.is_measured, inputs.pack_mV, inputs.link_mV);
  const SequenceStep result = step(before, inputs, config_.contactors);
  sequence_ = result.state;
  contactor_watch_.command(result.outputs, now);
  if (ledger_.command(result.outputs, pack_.current_mA)) {
    persistent_.contactors = ledger_.entries();
    touch_persistent();
  }
  outputs_ = result.outputs;
  if (sequence_.phase != before.phase) note_phase(now, before, result.precharge_failure);
  remember_closing(now, sequence_.phase != before.phase);
}

void Core::note_phase(TimePoint now, const SequenceState& before, PrechargeFailure failure) {
  events_.push({.id = EventId::phase_changed, .at = now, .phase_from = before.phase, .phase_to = sequence_.phase});
  const bool has_failed = failure != PrechargeFailure::none;
  const bool has_precharged = before.phase == Phase::precharge || before.phase == Phase::main_positive;
  if ((has_failed && has_precharged) || sequence_.phase == Phase::main_positive) {
    record_precharge(now, before.entered_at, failure);
  }
  // Only a link that stays with the pack under the closed main was a good try.
  if (has_failed || sequence_.phase == Phase::closed) failure = guard_.note_end(failure);
  if (sequence_.phase == Phase::open) record_opening(now, before.phase, failure);
}

/// What a life that begins now would have to know. While contactors are commanded it has to take the end of this one
/// for an opening for a reason, and while the resistor is in use for a try that failed and took all it bears.
void Core::remember_closing(TimePoint now, bool has_moved) {
  ClosingMemory memory = persistent_.closing;
  const Duration wait = outputs_.any_contactor() ? reclose_lockout : now < locked_out_until_ ? lockout_ : Duration{};
  memory.lockout_ms = to_ms(wait);
  const bool is_precharging = sequence_.phase == Phase::precharge;
  if (has_moved || guard_.is_cold()) memory.precharge = guard_.memory(is_precharging);
  if (memory == persistent_.closing) return;
  persistent_.closing = memory;
  touch_persistent();
}

void Core::step_auxiliary(TimePoint now) {
  const AuxiliaryOutputs auxiliary =
      auxiliary_.step({.now = now,
                       .may_drive = sequence_.phase == Phase::closed && permission_.may_discharge && wants_close() &&
                                    limits_.discharge.limit_mA > 0,
                       .may_run = !shutting_down_ && !rest_.is_resting(),
                       .cell_temperature_dC = pack_.cell_temperature_dC,
                       .throttle_permille = pdu_fresh(now) ? sensors_.pdu.value.throttle_permille : not_known()});
  ContactorOutputs outputs = outputs_;
  outputs.auxiliary = auxiliary.motor_enable;
  outputs.fan = auxiliary.fan;
  outputs.heater = auxiliary.heater;
  if (outputs != commanded_before_) outputs_changed_at_ = now;
  outputs_ = commanded_before_ = outputs;
}

void Core::set_limits(TimePoint now) {
  forecaster_.update({.now = now, .estimate = &estimate_, .pack = &pack_, .sensors = &sensors_}, config_);
  const PackSoc& charge = estimate_.pack();
  // As believed: the tables are for a long life. What protects are the voltages, whose forecast takes the doubt in.
  const auto soc_of = [this, &charge](std::size_t cell) {
    if (!charge.is_known) return std::optional<std::int32_t>{};
    return std::optional(static_cast<std::int32_t>(std::lround(estimate_.cell_soc(cell).soc * 1e3)));
  };
  const bool is_connected = sequence_.phase == Phase::closed && permission_.may_stay_closed;
  // A charger is paused, not a vehicle that brakes down a long hill.
  charge_pause_.update({.now = now,
                        .is_closed = is_connected && request_.is_by_charger(),
                        .soc_permille = soc_permille(),
                        .current_mA = pack_.current_mA});
  const CurrentLimits targets = evaluate_limits(
      pack_, config_,
      {.is_connected = is_connected,
       .may_discharge = permission_.may_discharge && !demands_zero_current(faults_, Concerns::discharge),
       .may_charge = permission_.may_charge && !demands_zero_current(faults_, Concerns::charge),
       .discharge_used_permille = watchers_.overload.discharge_used_permille(),
       .charge_used_permille = watchers_.overload.charge_used_permille(),
       .before = limits_,
       .soc_min_permille = soc_of(charge.emptiest),
       .soc_max_permille = soc_of(charge.fullest),
       .is_charge_paused = charge_pause_.is_pausing(),
       .predicted = forecaster_.limits()});
  limits_ = limit_ramps_.follow(targets, now, config_.limit_ramp);
}

void Core::record_precharge(TimePoint now, TimePoint began_at, PrechargeFailure failure) {
  const bool was_successful = failure == PrechargeFailure::none;
  last_precharge_ = {.has_run = true,
                     .was_successful = was_successful,
                     .failure = failure,
                     .ended_at = now,
                     .took = now - began_at,
                     .pack_mV = pack_.pack_voltage_mV.value,
                     .link_mV = pack_.link_voltage_mV.value,
                     .current_mA = pack_.current_mA.value};
  events_.push({.id = was_successful ? EventId::precharge_done : EventId::precharge_gave_up,
                .at = now,
                .number = to_ms(now - began_at)});
}

/// The fault that opened: of those that demand it, the one whose first bad sample came first.
OpeningRecord Core::opening_record(TimePoint now, Phase from, PrechargeFailure failure) const {
  constexpr std::array precharge_faults{FaultId::precharge_failed, FaultId::precharge_failed,
                                        FaultId::precharge_too_fast, FaultId::precharge_overcurrent,
                                        FaultId::contactor_welded};
  OpeningRecord record{.at = now, .from = from, .current_mA = pack_.current_mA};
  const FaultRow* fault = nullptr;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = faults_.state(row.id);
    if (!speaks_against(row.concerns, wish()) || !demands_opening(row, state, pack_, now)) continue;
    if (fault == nullptr || state.suspected_since < faults_.state(fault->id).suspected_since) fault = &row;
  }
  if (fault != nullptr) {
    const FaultState& state = faults_.state(fault->id);
    record.cause = OpeningCause::fault;
    record.fault = fault->id;
    record.reading = state.confirmed;
    record.threshold = state.threshold;
    record.is_restored = state.is_restored;
    record.suspected_since = state.suspected_since;
    record.confirmed_at = state.confirmed_at;
  } else if (failure != PrechargeFailure::none) {
    record.cause = OpeningCause::fault;
    record.fault = precharge_faults[static_cast<std::size_t>(failure)];
    const std::uint8_t contactor = failure == PrechargeFailure::welded ? main_positive_number : std::uint8_t{0};
    const Measured<std::int32_t>& link = pack_.link_voltage_mV;
    record.reading = {true, link.value, {.contactor = contactor}, link.taken_at};
    record.suspected_since = record.confirmed_at = now;
  } else if (shutting_down_) {
    record.cause = OpeningCause::shut_down;
  } else if (guard_.is_retrying() && request_.is_present()) {
    record.cause = OpeningCause::precharge_retry;
  } else if (!request_.is_present()) {
    record.cause = OpeningCause::request_over;
  } else {
    record.cause = OpeningCause::permission;
    record.blocker = permission_.blockers.empty() ? Blocker::fault : permission_.blockers[0];
    const bool is_restart = is_closing(from) && !setup_.is_complete() && !has_fault(permission_.blockers);
    if (is_restart) {
      record.blocker = Blocker::modules_not_set_up;
      record.reading = {.is_known = true, .element = {.module_node = flags_.module_not_set_up}, .taken_at = now};
    }
  }
  return record;
}

void Core::record_opening(TimePoint now, Phase from, PrechargeFailure failure) {
  const OpeningRecord record = opening_record(now, from, failure);
  flags_.precharge_failure = failure;  // a fault from the next tick on
  link_shows_weld_ = link_shows_weld_ || failure == PrechargeFailure::welded;
  last_opening_ = record;
  if (!keeps_wish(record.cause)) request_.drop();
  const Duration wait = reclose_wait(record.cause, now, request_over_at_, config_.contactors.precharge_cool_down);
  if (record.cause == OpeningCause::request_over) request_over_at_ = now;
  lockout_ = wait;
  locked_out_until_ = now + wait;
  events_.push({.id = EventId::opened,
                .at = now,
                .fault = record.fault,
                .reading = record.reading,
                .threshold = record.threshold,
                .phase_from = from,
                .cause = record.cause,
                .number = static_cast<std::int64_t>(record.blocker)});
}

/// A resting pack has nothing to command: it is open, and the unit keeps it so by itself.
void Core::send_contactor_command(TimePoint now, Decisions& out) {
  if (!config_.contactors.has_pdu || (rest_.is_resting() && !outputs_.any_contactor())) return;
  if (!command_link_.is_due(now, outputs_changed_at_ == now)) return;
  command_link_.note_sent(command_counter_, now);
  send(Port::internal, contactor_command_frame(outputs_, command_counter_), out);
  ++command_counter_;
}

void Core::send_report(TimePoint now, Decisions& out) {
  if (rest_.is_resting() || (ports_share_bus_ && command_link_.is_stuck(now))) return;
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

// --- what they ask ---------------------------------------------------------------------------------------------------

void Core::note_fault_changes(const FaultChanges& changes, TimePoint now) {
  using Kind = FaultChange::Kind;
  constexpr std::array event_of{EventId::fault_warned, EventId::fault_warning_over, EventId::fault_confirmed,
                                EventId::fault_cause_gone, EventId::fault_cleared};
  for (const FaultChange& change : changes) {
    const FaultState& state = faults_.state(change.id);
    if (change.kind == Kind::confirmed) record_confirmed(change.id, now);
    if (change.kind == Kind::cleared) record_cleared(change.id, now);
    const bool is_warning = change.kind == Kind::warned || change.kind == Kind::warning_over;
    const Thresholds thresholds = thresholds_of(row_of(change.id), config_.limits);
    events_.push({.id = event_of[static_cast<std::size_t>(change.kind)],
                  .at = now,
                  .fault = change.id,
                  .reading = is_warning ? state.warning : state.confirmed,
                  .threshold = is_warning ? thresholds.warn : thresholds.open});
  }
}

void Core::record_confirmed(FaultId id, TimePoint now) {
  FaultRecord& record = persistent_.faults[static_cast<std::size_t>(id)];
  const std::int64_t unix_ms = unix_time_ms(now);
  if (record.count == 0) record.first_unix_time_ms = unix_ms;
  record.last_unix_time_ms = unix_ms;
  ++record.count;
  record.is_locked = record.is_locked || locks(row_of(id), outputs_.any_contactor() && !shutting_down_);
  record.frame = freeze({.now = now,
                         .unix_time_ms = unix_ms,
                         .config = config_,
                         .fault = faults_.state(id),
                         .pack = pack_,
                         .sensors = sensors_,
                         .limits = limits_,
                         .soc_permille = soc_permille(),
                         .overload = watchers_.overload,
                         .outputs = outputs_,
                         .phase = sequence_.phase,
                         .mode = mode_before_});
  touch_persistent();
}

void Core::record_cleared(FaultId id, TimePoint now) {
  if (row_of(id).latch == Latch::none) return;
  FaultRecord& record = persistent_.faults[static_cast<std::size_t>(id)];
  record.is_locked = false;
  record.cleared = {
      .unix_time_ms = unix_time_ms(now), .user_id = clear_given_.user_id, .authority = clear_given_.authority};
  guard_.forget_tries();
  touch_persistent();
}

std::optional<std::int32_t> Core::soc_permille() const {
  if (!estimate_.pack().is_known) return std::nullopt;
  return estimate_.told_permille();
}

FaultInputs Core::fault_inputs(TimePoint now) const {
  return {.now = now,
          .config = &config_,
          .pack = &pack_,
          .modules = &modules_,
          .sensors = &sensors_,
          .watchers = &watchers_,
          .soc_disagreement_permille = estimate_.disagreement_permille(),
          .cell_misfit_permille = estimate_.misfit_permille(),
          .flags = flags_,
          .has_started = has_started(now)};
}

VehicleView Core::vehicle_view(TimePoint now) const {
  const TroubleCodes codes = trouble_codes(faults_);
  return {.state = static_cast<vehicle_bus::State>(iha_state(mode())),
          .uptime = now - started_at_,
          .dtc_1 = codes.first,
          .dtc_2 = codes.second,
          .pack = &pack_,
          .limits = &limits_,
          .soc_permille = soc_permille(),
          .depth_of_discharge_uAs =
              estimate_.pack().is_known ? std::optional(estimate_.depth_of_discharge_uAs()) : std::nullopt,
          .capacity_uAs = config_.cell.capacity_uAs,
          .totals = totals(),
          .estimate = &estimate_};
}

ModeInputs Core::mode_inputs() const {
  const bool has_fault = std::any_of(fault_table().begin(), fault_table().end(), [this](const FaultRow& row) {
    return row.reaction >= Reaction::open_after_grace && faults_.state(row.id).is_present();
  });
  const PduState pdu = pdu_fresh(decided_at_) ? sensors_.pdu.value : PduState{};  // a line nobody tells is off
  return {.phase = sequence_.phase,
          .rest = rest_.phase(),
          .has_fault = has_fault,
          .may_discharge = permission_.may_discharge,
          .vehicle_on = pdu.vehicle_on,
          .charger_connected = pdu.charger_connected,
          .current_mA = pack_.current_mA.is_valid() ? pack_.current_mA.value : 0,
          .outputs = outputs_,
          .has_relay_fault = has_relay_fault(faults_)};
}

/// Before the precharge contactor is commanded nothing may bring the link to the pack's voltage.
bool Core::link_follows_though_open() const {
  const bool is_open = sequence_.phase == Phase::open || sequence_.phase == Phase::main_negative;
  return is_open && pack_.is_sensed() &&
         link_follows(pack_.pack_voltage_mV.value, pack_.link_voltage_mV.value, config_.contactors);
}

bool Core::pdu_fresh(TimePoint now) const {
  return sensors_.pdu.is_usable(now, config_.ages.pdu_status);
}

bool Core::inputs_healthy(TimePoint now) const {
  return pdu_fresh(now) && sensors_.pdu.value.is_healthy();
}

bool Core::insulation_known(TimePoint now) const {
  const bool is_asked_for = config_.insulation.monitoring == InsulationMonitoring::measured;
  return !is_asked_for || (pdu_fresh(now) && knows_insulation(sensors_.pdu.value));
}

bool Core::has_started(TimePoint now) const {
  if (rest_.is_resting()) return false;  // nobody is asked, nobody answers
  return seen_complete_ || (flags_.internal_bus_up && now - view_began_at_ >= start_grace);
}

/// A key or a charger is there, whether or not what it asked for was refused.
bool Core::could_ask(TimePoint now) const {
  const PduState& pdu = sensors_.pdu.value;
  return pdu_fresh(now) && (pdu.vehicle_on || pdu.charger_connected);
}

/// Leaves when the contacts have confirmed, in a word younger than the command; or when patience is over.
bool Core::end_shut_down(TimePoint now) {
  if (!shutting_down_) return false;
  const Measured<PduState>& pdu = sensors_.pdu;
  if (outputs_.any_contactor()) return false;  // the current is asked to zero first
  const TimePoint waiting_since = std::max(shut_down_at_, flags_.open_since);
  const bool is_confirmed = pdu_fresh(now) && pdu.taken_at > waiting_since && !pdu.value.any_contactor_closed();
  if (is_confirmed || now - waiting_since < shut_down_patience) return is_confirmed;
  if (!std::exchange(shut_down_told_, true)) events_.push({.id = EventId::shut_down_unconfirmed, .at = now});
  return true;
}

}  // namespace bmu
