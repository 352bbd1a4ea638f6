// Stages of the core for charging: commands to the chargers, and resuming a charge.
#include <algorithm>
#include <numeric>

#include "daemon/core/core.hpp"

namespace bmu {

/// While the PDU status is not fresh the state of the plug is unchanged.
void Core::follow_plug(TimePoint now) {
  if (!pdu_fresh(now)) return;
  is_plugged_in_ = sensors_.pdu.value.charger_connected;
  if (is_plugged_in_) return;
  charge_resume_.start_over();
  errors_cleared_ = 0;
}

/// Balancing is in progress or may be required, and nothing inhibits it.
bool Core::has_to_balance() const {
  return balancing_.blockers() == 0 && balancing_.verdict() != PlanVerdict::balanced;
}

bool Core::is_bleeding() const {
  return balancing_.blockers() == 0 && balancing_.state() == BalancingState::bleeding && watchers_.switches.is_any_on();
}

void Core::charge(TimePoint now) {
  if (!chargers_.is_there()) return;
  follow_plug(now);
  const bool is_open_way = !config_.contactors.has_charge_contactor || outputs_.charge;
  charger_watch_.update({.now = now,
                         .is_plugged_in = is_plugged_in_,
                         .is_alone = !pdu_fresh(now) || !sensors_.pdu.value.vehicle_on,
                         .is_enabled = charge_.is_enabled(),
                         .asked_mA = charge_.current_mA(),
                         .asked_mV = charge_.voltage_mV(),
                         .pack = &pack_,
                         .table = &chargers_});
  resume_charge(now);
  const ChargeStage before = charge_.stage();
  charge_.step({.now = now,
                .is_wanted = is_plugged_in_ && !shutting_down_,
                .is_connected = sequence_.phase == Phase::closed && is_open_way && request_.is_by_charger(),
                .may_charge = permission_.may_charge,
                .is_talking = chargers_.talking_count(now) > 0,
                .has_to_balance = has_to_balance(),
                .is_bleeding = is_bleeding(),
                .pack = &pack_,
                .limits = &limits_,
                .soc_permille = soc_permille()});
  if (charge_.stage() != before) {
    events_.push(
        {.id = EventId::charge_stage_changed, .at = now, .number = static_cast<std::int64_t>(charge_.stage())});
  }
  // The charger's request for a full pack is dropped: closing again requires a new request. Current drawn from the pack
  // does not delay this; current that still flows into it does.
  const bool has_ended = pack_.current_mA.is_valid() && pack_.current_mA.value >= -small_current_mA;
  if (charge_.is_done() && request_.is_by_charger() && has_ended) request_.drop_charger();
}

/// Inputs healthy, no other fault and no shutdown: the pack was left untouched since its charger was lost.
bool Core::is_hands_off(TimePoint now) const {
  const bool has_other_fault = std::any_of(fault_table().begin(), fault_table().end(), [this](const FaultRow& row) {
    return row.id != FaultId::charger_silent && faults_.state(row.id).is_present() &&
           reaction_of(row, config_.stricter_reactions).reaction != Reaction::warn;
  });
  return inputs_healthy(now) && !has_other_fault && !shutting_down_;
}

/// Resumes a charge after a power cut, as if the charger had been plugged in again.
void Core::resume_charge(TimePoint now) {
  const bool goes_on = charge_resume_.step({.now = now,
                                            .is_silent = charger_watch_.silent_unit() != 0,
                                            .has_fault = faults_.state(FaultId::charger_silent).is_present(),
                                            .is_charging = charge_.is_enabled(),
                                            .is_hands_off = is_hands_off(now),
                                            .all_talk = chargers_.talking_count(now) == chargers_.unit_count(),
                                            .is_wanted = request_.is_by_charger()});
  if (goes_on) request_.plug_in_again();
}

/// Clears errors that a charger latched while it received no commands, by a signal that is set and reset; several
/// times, since some errors need more than one.
bool Core::clears_charger_errors(std::size_t unit, TimePoint now) {
  constexpr Duration every = 2s;
  constexpr std::uint8_t tries_max = 10;
  const bool has_trouble = is_plugged_in_ && chargers_.unit(unit).report.troubles != 0;
  if (!has_trouble || errors_cleared_ >= tries_max || now - errors_cleared_at_ < every) return false;
  errors_cleared_at_ = now;
  ++errors_cleared_;
  return true;
}

/// Never for a pack that is open, or must not be charged: mains is not needed then.
bool Core::may_request_mains() const {
  return config_.charger.requests_mains && permission_.may_charge && charge_.is_in_progress();
}

/// The units that report share the current; a unit that is lost may still receive, and is commanded to stop.
ChargerOrder Core::order_of_unit(std::size_t unit, TimePoint now) const {
  ChargerOrder order{.master_address = config_.charger.master_address,
                     .voltage_mV = charge_.voltage_mV(),
                     .mains_current_mA = config_.charger.mains_current_max_mA,
                     .requests_mains = may_request_mains() && chargers_.is_talking(unit, now)};
  const auto sharing = static_cast<std::int32_t>(chargers_.talking_count(now));
  if (!charge_.is_enabled() || !chargers_.is_talking(unit, now)) return order;
  order.is_enabled = true;
  // A unit that reports later waits until the others have reduced their current for it.
  const TimePoint talks_since = chargers_.unit(unit).talks_since;
  const bool is_late = talks_since > charge_.since() && now - talks_since < chargers_.driver().settle;
  if (!is_late) order.current_mA = charge_.current_mA() / sharing;
  return order;
}

/// Also sent while no current is requested: a charger without commands may act on its own. Reductions are sent
/// immediately.
void Core::send_charger_commands(TimePoint now, Decisions& out) {
  constexpr std::int32_t step_mA = 500;
  if (!chargers_.is_there() || rest_.is_resting() || !has_way(Port::charger, now)) return;
  if (!ports_[static_cast<std::size_t>(Port::charger)].is_up) return;  // sent once the bus is up
  const Duration since_last = now - charger_command_at_;
  const std::int32_t told_mA = std::accumulate(ordered_mA_.begin(), ordered_mA_.end(), 0);
  const bool has_stopped = (was_enabled_ && !charge_.is_enabled()) || (was_in_progress_ && !charge_.is_in_progress());
  const bool has_fallen = charge_.current_mA() + step_mA <= told_mA && since_last >= charger_at_once;
  const bool is_due = charger_command_at_ == TimePoint{} || since_last >= chargers_.driver().command_period;
  if (!is_due && !has_stopped && !has_fallen) return;
  charger_command_at_ = now;
  was_enabled_ = charge_.is_enabled();
  was_in_progress_ = charge_.is_in_progress();
  for (std::size_t unit = 0; unit < chargers_.unit_count(); ++unit) {
    ChargerOrder order = order_of_unit(unit, now);
    order.clears_errors = clears_charger_errors(unit, now);
    const CanFrame command = chargers_.driver().command(static_cast<std::uint8_t>(unit), order);
    // A command that was not sent does not count as commanded: the gate would rely on it the next time.
    if (send(Port::charger, command, out)) ordered_mA_[unit] = order.current_mA;
  }
}

}  // namespace bmu
