// Stages of the core for values that are followed over many ticks and saved for the next session, and for the
// explanation of an opening.
#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "daemon/core/core.hpp"

namespace bmu {

namespace {

/// Interval of the check whether the estimate is worth a record.
constexpr Duration estimate_look_every = 5s;

}  // namespace

void Core::estimate(TimePoint now) {
  watchers_.trend.update(modules_);
  watchers_.stuck.update(modules_, pack_.current_mA, sensors_.current_window);
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
  estimate_kept_at_ = now - estimate_look_every;  // the record of a previous session is obsolete
}

/// When a cell has changed enough, at most every few seconds, since a file is written for it. Again at the end, when no
/// current can flow any more.
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

void Core::keep_hours_since_full(TimePoint now) {
  const std::uint32_t hours = inverter_reporter_.hours_since_full(now);
  if (hours == persistent_.hours_since_full) return;
  persistent_.hours_since_full = hours;
  touch_persistent();
}

/// Not before the whole pack was received: a daemon that ends before that does not count as a session of the pack.
void Core::count_start() {
  if (is_start_counted_ || !has_memory_ || !seen_complete_) return;
  is_start_counted_ = true;
  if (persistent_.starts < std::numeric_limits<std::uint32_t>::max()) ++persistent_.starts;
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

/// At most every `record_every`, and again at the end, since a file is written for it.
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

/// Saves the closing state that a session starting now would need. While contactors are commanded it has to treat the
/// end of this session as an opening for a reason, and while the precharge resistor is in use as a failed attempt that
/// used its whole energy rating.
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
  Event event{.id = was_successful ? EventId::precharge_done : EventId::precharge_gave_up,
              .at = now,
              .number = to_ms(now - began_at)};
  if (!was_successful && pack_.is_sensed()) {
    event.reading = {true, pack_.link_voltage_mV.value, {}, pack_.link_voltage_mV.taken_at};
    event.threshold = pack_.pack_voltage_mV.value;
  }
  events_.push(event);
}

/// Record of an opening. Of the faults that require it, the one with the earliest first bad sample is the cause.
OpeningRecord Core::opening_record(TimePoint now, Phase from, PrechargeFailure failure) const {
  constexpr std::array precharge_faults{FaultId::precharge_failed, FaultId::precharge_failed,
                                        FaultId::precharge_too_fast, FaultId::precharge_overcurrent,
                                        FaultId::contactor_welded};
  OpeningRecord record{.at = now, .from = from, .current_mA = ledger_.broken_mA()};
  const FaultRow* fault = nullptr;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = faults_.state(row.id);
    if (!speaks_against(row.concerns, wish()) || !demands_opening(row, state, pack_, now, config_)) continue;
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
    const bool is_welded = failure == PrechargeFailure::welded;
    const std::uint8_t contactor = is_welded ? contactor_number(ContactorId::main_positive) : std::uint8_t{0};
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
                         .mode = mode_before_,
                         .link_time_constant = watchers_.link.time_constant()});
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

}  // namespace bmu
