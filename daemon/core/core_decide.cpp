// Decisions of the core once a tick, in one fixed order.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "daemon/core/core.hpp"

namespace bmu {

namespace {

/// Maximum wait for the feedback after a shutdown command and after all contactors were commanded open; then the
/// session ends nevertheless.
constexpr Duration shut_down_patience = 500ms;

/// Encoding as read by event.cpp.
void put_excess(Event& event, const ChargerExcess& excess) {
  event.reading.value = excess.is_voltage ? 2 : 1;
  event.threshold = excess.asked;
  event.number = excess.given;
}

}  // namespace

Decisions Core::decide(TimePoint now) {
  Decisions out;
  ++ticks_;
  check_loop_gap(now);
  follow_claim(now);
  decided_at_ = now;
  sensors_.take_insulation(insulation_.word(now), config_);
  pack_ = summarise(modules_, sensors_, config_, now);
  seen_complete_ = seen_complete_ || (pack_.is_complete() && pack_.is_sensed() && pdu_fresh(now));
  count_start();
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
  charge(now);
  send_contactor_command(now, out);
  send_charger_commands(now, out);
  ask_sensor(sensor_setup_, now, out);
  ask_sensor(second_sensor_setup_, now, out);
  send_polls(now, out);
  balance(now, out);
  send_broadcasts(now, out);
  send_report(now, out);
  send_cell_data(now, out);
  tell_inverter(now, out);
  answer_request(now, out);
  out.is_shut_down = end_shut_down(now);
  events_.move_to(out.events);
  out.outputs = outputs_;
  out.wake_at = advance_tick(now);
  return out;
}

/// Deadlines advance by the period, so an early tick between two of them moves nothing.
TimePoint Core::advance_tick(TimePoint now) {
  if (next_tick_ <= now) next_tick_ += tick_period;
  if (next_tick_ <= now) next_tick_ = now + tick_period;  // late by more than a period; no burst to catch up
  return next_tick_;
}

void Core::check_loop_gap(TimePoint now) {
  flags_.tick_was_late = decided_at_ != TimePoint{} && now - next_tick_ > tick_late;
  const bool is_gap = decided_at_ != TimePoint{} && now - decided_at_ > loop_gap_max;
  if (!is_gap) return;
  events_.push({.id = EventId::loop_gap, .at = now, .number = to_ms(now - decided_at_)});
  flags_.loop_gap_seen = true;
  claim_.note_gap(now - decided_at_, now);
  start_over(now);
}

/// Nothing is polled before the claim is held: until then missing answers are no loss.
void Core::follow_claim(TimePoint now) {
  if (!shutting_down_) claim_.step(now);
  if (!claim_.may_command()) view_began_at_ = now;
}

void Core::follow_rest(TimePoint now) {
  const PduState& pdu = sensors_.pdu.value;
  const bool knows_lines = pdu_fresh(now);
  const bool was_resting = rest_.is_resting();
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
  if (was_resting) claim_.wake();
  // All values are invalid when the pack falls asleep and when it wakes up. The PDU continues to report in between, and
  // a close request that woke the pack is kept.
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
  flags_.contactor_welded = link_shows_weld_ ? contactor_number(ContactorId::main_positive) : disobedience.welded;
  flags_.closing_is_commanded = outputs_.any_contactor();
  flags_.command_not_on_bus = config_.contactors.has_pdu && !command_link_.is_on_bus(now);
  const bool is_closed = sequence_.phase == Phase::closed;
  flags_.closed_since = is_closed ? sequence_.entered_at : TimePoint{};
  const auto keep_since = [now](TimePoint& since, bool holds) {
    if (!holds) since = {};
    if (holds && since == TimePoint{}) since = now;
  };
  keep_since(flags_.open_since, !outputs_.any_contactor());
  watchers_.link.update(flags_.open_since, pack_.link_voltage_mV, config_.contactors.settle);
  keep_since(flags_.charge_forbidden_since, is_closed && forbids(faults_, Concerns::charge));
  keep_since(flags_.discharge_forbidden_since, is_closed && forbids(faults_, Concerns::discharge));
  // A pack at a charger is not driving, whether or not its key is on.
  const bool is_at_charger = !pdu_fresh(now) || sensors_.pdu.value.charger_connected;
  flags_.is_driving = is_closed && request_.is_by_vehicle() && !is_at_charger;
}

void Core::evaluate_faults(TimePoint now) {
  mode_before_ = mode(now);
  flags_.sensor_not_set_up = sensor_setup_.has_failed() || second_sensor_setup_.has_failed();
  flags_.insulation_untested = insulation_.is_untested(now);
  if (std::exchange(clear_ours_, false)) note_fault_changes(faults_.clear_latched(clear_given_.authority), now);
  note_fault_changes(faults_.update(fault_inputs(now)), now);
  // One evaluation is enough; the fault memory keeps the result.
  flags_.precharge_failure = PrechargeFailure::none;
  flags_.clock_jumped = false;
  flags_.foreign_master_seen = false;
  flags_.loop_gap_seen = false;
  flags_.frames_lost_seen = false;
  flags_.pdu_restarted = false;
}

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
    Event event{.id = event_of[static_cast<std::size_t>(change.kind)],
                .at = now,
                .fault = change.id,
                .reading = is_warning ? state.warning : state.confirmed,
                .threshold = is_warning ? thresholds.warn : thresholds.open,
                .is_stricter = reaction_of(row_of(change.id), config_.stricter_reactions).is_stricter};
    if (change.id == FaultId::charger_runaway && change.kind == Kind::confirmed) {
      put_excess(event, charger_watch_.excess());
    }
    if (change.kind == Kind::confirmed) event.likely = likely_cause(change.id, now);
    events_.push(event);
  }
}

void Core::grant_permission(TimePoint now) {
  permission_ = evaluate_permission({.now = now,
                                     .wish = wish(),
                                     .is_plugged_in = is_plugged_in_,
                                     .is_shutting_down = shutting_down_,
                                     .is_resting = rest_.is_resting(),
                                     .may_command = claim_.may_command(),
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
                                    pack_, faults_, config_);
}

void Core::refuse_vain_request(TimePoint now) {
  const bool is_waiting = request_.is_present() && sequence_.phase == Phase::open && !permission_.may_close;
  if (!is_waiting) return;
  const auto& blockers = permission_.blockers;
  if (!is_vain(blockers, now - request_.since(), guard_.is_retrying())) return;
  request_.drop();
  last_refusal_ = refusal_record(now, has_fault(blockers) ? Blocker::fault : blockers[0]);
  events_.push({.id = EventId::close_refused,
                .at = now,
                .fault = last_refusal_.fault,
                .reading = last_refusal_.reading,
                .threshold = last_refusal_.threshold,
                .number = static_cast<std::int64_t>(last_refusal_.blocker)});
}

/// With the values that caused it: of the first fault that inhibits closing, or DC link and pack voltage. Those of a
/// fault are from its confirmation.
RefusalRecord Core::refusal_record(TimePoint now, Blocker blocker) const {
  RefusalRecord record{.has_happened = true, .at = now, .blocker = blocker};
  if (blocker == Blocker::link_follows) {
    record.reading = {true, pack_.link_voltage_mV.value, {}, pack_.link_voltage_mV.taken_at};
    record.threshold = pack_.pack_voltage_mV.value;
  }
  if (blocker != Blocker::fault) return record;
  const auto* const row = std::find_if(fault_table().begin(), fault_table().end(), [this](const FaultRow& one) {
    return keeps_open_for(one, faults_.state(one.id), wish(), is_plugged_in_, config_.stricter_reactions);
  });
  if (row == fault_table().end()) return record;
  record.fault = row->id;
  record.reading = faults_.state(row->id).confirmed;
  record.threshold = faults_.state(row->id).threshold;
  if (!is_about_link(row->id)) return record;
  const std::optional<FreezeFrame>& frame = persistent_.faults[static_cast<std::size_t>(row->id)].frame;
  const bool is_known = frame && frame->link_voltage_mV && frame->pack_voltage_mV;
  record.reading.value = is_known ? *frame->link_voltage_mV : 0;
  record.threshold = is_known ? *frame->pack_voltage_mV : 0;
  return record;
}

/// The voltages of a closing are valid only while the sensor's pack voltage and the sum of the cells match.
SequenceInputs Core::sequence_inputs(TimePoint now) const {
  const Measured<std::int32_t>& sum = pack_.cell_voltage_sum_mV;
  const Measured<std::int32_t>& pack = pack_.pack_voltage_mV;
  return {.now = now,
          .close_wanted = wants_close(),
          .close_permitted = is_permitted(permission_, sequence_.phase),
          .may_advance = permission_.may_advance,
          .contacts_settled = contactor_watch_.is_settled(),
          .contacts_since = contactor_watch_.obeying_since(),
          .is_unplugged = request_.is_unplugged(),
          .charge_wanted = request_.is_by_charger(),
          .charge_permitted = permission_.may_charge,
          .resistor_is_hot = guard_.is_overheated(),
          .is_current_known = pack_.current_mA.is_valid(),
          .current_mA = pack_.current_mA.value,
          .current_at = pack_.current_mA.taken_at,
          .is_measured = pack_.is_sensed() && voltages_agree(sum, pack, config_.limits.pack_voltage_mismatch.open),
          .cells_mV = sum.value,
          .pack_mV = pack.value,
          .pack_at = pack.taken_at,
          .pack_before_mV = pack_.pack_voltage_before_mV.value,
          .link_mV = pack_.link_voltage_mV.value,
          .link_at = pack_.link_voltage_mV.taken_at};
}

void Core::step_contactors(TimePoint now) {
  const SequenceState before = sequence_;
  const SequenceInputs inputs = sequence_inputs(now);
  // The heat of the resistor is calculated from the higher of the two voltages.
  guard_.update(now, before.phase == Phase::precharge, inputs.is_measured, std::max(inputs.pack_mV, inputs.cells_mV),
                inputs.link_mV);
  watchers_.rise.update(before, inputs, config_.contactors);
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
  // An attempt succeeds only if the DC link stays at pack voltage with main positive closed.
  if (has_failed || sequence_.phase == Phase::closed) failure = guard_.note_end(failure);
  if (sequence_.phase == Phase::open) record_opening(now, before.phase, failure);
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
  // The estimated SOC without its uncertainty: the tables limit ageing. The voltages protect the cells, and their
  // prediction includes the uncertainty.
  const auto soc_of = [this, &charge](std::size_t cell) {
    if (!charge.is_known) return std::optional<std::int32_t>{};
    return std::optional(static_cast<std::int32_t>(std::lround(estimate_.cell_soc(cell).soc * 1e3)));
  };
  const bool is_connected = sequence_.phase == Phase::closed && permission_.may_stay_closed;
  // A charger is paused, not a vehicle that regenerates on a long descent.
  charge_pause_.update({.now = now,
                        .is_closed = is_connected && request_.is_by_charger(),
                        .soc_permille = soc_permille(),
                        .current_mA = pack_.current_mA,
                        .is_resistance_known = estimate_.knows_resistances()});
  const CurrentLimits targets = evaluate_limits(
      pack_, config_,
      {.is_connected = is_connected,
       .may_discharge = permission_.may_discharge && !demands_zero_current(faults_, Concerns::discharge, config_),
       .may_charge = permission_.may_charge && !demands_zero_current(faults_, Concerns::charge, config_),
       .discharge_used_permille = watchers_.overload.discharge_used_permille(),
       .charge_used_permille = watchers_.overload.charge_used_permille(),
       .before = limits_,
       .soc_min_permille = soc_of(charge.emptiest),
       .soc_max_permille = soc_of(charge.fullest),
       .is_charge_paused = charge_pause_.is_pausing(),
       .predicted = forecaster_.limits()});
  limits_ = limit_ramps_.follow(targets, now, config_.limit_ramp);
  lower_to_power(limits_, pack_, config_.pack_limits);
}

/// Ends when the feedback confirms open contactors, in a status younger than the command, and no module continues to
/// bleed by its last command; or when shut_down_patience has elapsed.
bool Core::end_shut_down(TimePoint now) {
  if (!shutting_down_) return false;
  const Measured<PduState>& pdu = sensors_.pdu;
  if (outputs_.any_contactor()) return false;  // the current is first requested to zero
  const TimePoint waiting_since = std::max(shut_down_at_, flags_.open_since);
  const bool is_confirmed = pdu_fresh(now) && pdu.taken_at > waiting_since && !pdu.value.any_contactor_closed();
  const bool may_leave = is_confirmed && rounds_.have_stopped_bleeding(now);
  if (may_leave || now - waiting_since < shut_down_patience) return may_leave;
  if (!is_confirmed && !std::exchange(shut_down_told_, true))
    events_.push({.id = EventId::shut_down_unconfirmed, .at = now});
  return true;
}

}  // namespace bmu
