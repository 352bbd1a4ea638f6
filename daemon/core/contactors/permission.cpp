#include "daemon/core/contactors/permission.hpp"

#include <algorithm>
#include <cstdlib>

namespace bmu {

std::string_view to_text(Blocker blocker) {
  switch (blocker) {
    case Blocker::shutting_down: return "daemon shutting down";
    case Blocker::fault: return "fault confirmed";
    case Blocker::resting:
      return "modules asleep after an undervoltage; wake with the resume button, a charger or `bmuctl wake`";
    case Blocker::internal_bus_down: return "internal bus down";
    case Blocker::pdu_unknown: return "status of contacts and inputs stale";
    case Blocker::inputs_unhealthy: return "emergency stop, interlock or insulation monitor tripped";
    case Blocker::insulation_unknown: return "insulation resistance unknown";
    case Blocker::modules_incomplete: return "module data incomplete or stale";
    case Blocker::sensors_incomplete: return "current, pack voltage or DC link voltage missing or stale";
    case Blocker::not_qualified: return "fewer than three complete poll cycles";
    case Blocker::modules_not_set_up: return "cell limits not acknowledged by a module";
    case Blocker::suspicion: return "fault pending";
    case Blocker::commands_not_on_bus: return "contactor commands not transmitted";
    case Blocker::contacts_unsettled: return "contactor feedback not settled";
    case Blocker::contactor_closed: return "contactor feedback closed although all commanded open";
    case Blocker::link_follows: return "DC link still at pack voltage (welding not excluded)";
    case Blocker::precharge_hot: return "precharge resistor cooling down";
    case Blocker::locked_out: return "reclose lockout after the last opening";
    case Blocker::no_claim: return "checking for another master of this pack";
  }
  return "?";
}

bool speaks_against(Concerns concerns, const Wish& wish) {
  switch (concerns) {
    case Concerns::all: return true;
    case Concerns::charge: return wish.by_charger && !wish.by_vehicle;
    case Concerns::discharge: return !wish.by_charger;
  }
  return true;
}

bool opens_for(const FaultRow& row, const FaultState& state, const Wish& wish, const StricterReactions& stricter) {
  return state.is_present() && reaction_of(row, stricter).reaction >= Reaction::open_after_grace &&
         speaks_against(row.concerns, wish);
}

bool keeps_open_for(const FaultRow& row, const FaultState& state, const Wish& wish, bool is_plugged_in,
                    const StricterReactions& stricter) {
  return state.is_present() && reaction_of(row, stricter).reaction != Reaction::warn &&
         (speaks_against(row.concerns, wish) || (row.bars_while_plugged_in && is_plugged_in));
}

bool waits_for_break(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now,
                     const ContactorConfig& contactors) {
  if (!row.waits_above_rating || contactors.break_current_max_mA == 0 || !pack.current_mA.is_valid()) return false;
  const std::int64_t magnitude_mA = std::llabs(std::int64_t{pack.current_mA.value});
  return magnitude_mA > contactors.break_current_max_mA && now - state.confirmed_at < break_wait_max;
}

bool demands_opening(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now,
                     const CoreConfig& config) {
  if (!state.is_present()) return false;
  const FaultReaction does = reaction_of(row, config.stricter_reactions);
  if (does.reaction < Reaction::open_after_grace) return false;
  if (does.reaction == Reaction::open_now) return !waits_for_break(row, state, pack, now, config.contactors);
  const bool grace_is_over = now - state.confirmed_at >= does.grace;
  return grace_is_over || !pack.current_mA.is_valid() || is_small_current(pack.current_mA.value);
}

bool demands_zero_current(const FaultMemory& faults, Concerns direction, const CoreConfig& config) {
  const bool is_rated = config.contactors.break_current_max_mA > 0;
  return std::any_of(fault_table().begin(), fault_table().end(), [&](const FaultRow& row) {
    const bool is_concerned = is_about(row, direction) && faults.state(row.id).is_present();
    return is_concerned && ((is_rated && row.waits_above_rating) ||
                            reaction_of(row, config.stricter_reactions).reaction == Reaction::open_after_grace);
  });
}

bool forbids(const FaultMemory& faults, Concerns direction) {
  return std::any_of(fault_table().begin(), fault_table().end(), [&](const FaultRow& row) {
    return row.concerns == direction && faults.state(row.id).is_present();
  });
}

namespace {

/// Whether `holds` is true for any row.
template <class Holds>
bool any_row(Holds holds) {
  return std::any_of(fault_table().begin(), fault_table().end(), holds);
}

bool any_present(const FaultMemory& faults, const PermissionInputs& inputs, const CoreConfig& config) {
  return any_row([&](const FaultRow& row) {
    return keeps_open_for(row, faults.state(row.id), inputs.wish, inputs.is_plugged_in, config.stricter_reactions);
  });
}

bool any_suspected(const FaultMemory& faults, const Wish& wish, const CoreConfig& config) {
  return any_row([&](const FaultRow& row) {
    return faults.state(row.id).stage == FaultStage::suspected && speaks_against(row.concerns, wish) &&
           reaction_of(row, config.stricter_reactions).reaction != Reaction::warn;
  });
}

bool any_demands_opening(const FaultMemory& faults, const PackState& pack, const PermissionInputs& inputs,
                         const CoreConfig& config) {
  return any_row([&](const FaultRow& row) {
    return speaks_against(row.concerns, inputs.wish) &&
           demands_opening(row, faults.state(row.id), pack, inputs.now, config);
  });
}

bool forbids_current(const FaultMemory& faults, const PackState& pack, TimePoint now, Concerns direction,
                     const CoreConfig& config) {
  return any_row([&](const FaultRow& row) {
    return is_about(row, direction) && demands_opening(row, faults.state(row.id), pack, now, config);
  });
}

}  // namespace

Permission evaluate_permission(const PermissionInputs& inputs, const PackState& pack, const FaultMemory& faults,
                               const CoreConfig& config) {
  Permission permission;
  const auto block_if = [&permission](bool blocks, Blocker blocker) {
    if (blocks) permission.blockers.push_back(blocker);
  };
  block_if(inputs.is_shutting_down, Blocker::shutting_down);
  block_if(any_present(faults, inputs, config), Blocker::fault);
  block_if(inputs.is_resting, Blocker::resting);
  block_if(!inputs.may_command, Blocker::no_claim);
  block_if(!inputs.internal_bus_up, Blocker::internal_bus_down);
  block_if(!inputs.pdu_fresh, Blocker::pdu_unknown);
  block_if(inputs.pdu_fresh && !inputs.inputs_healthy, Blocker::inputs_unhealthy);
  block_if(inputs.pdu_fresh && !inputs.insulation_known, Blocker::insulation_unknown);
  block_if(!pack.is_complete(), Blocker::modules_incomplete);
  block_if(!pack.is_sensed(), Blocker::sensors_incomplete);
  block_if(inputs.complete_cycles < qualifying_cycles, Blocker::not_qualified);
  block_if(!inputs.modules_set_up, Blocker::modules_not_set_up);
  block_if(any_suspected(faults, inputs.wish, config), Blocker::suspicion);
  block_if(!inputs.commands_are_on_bus, Blocker::commands_not_on_bus);
  block_if(inputs.pdu_fresh && !inputs.contacts_settled, Blocker::contacts_unsettled);
  block_if(inputs.contactor_closed_though_open, Blocker::contactor_closed);
  block_if(inputs.link_follows_though_open, Blocker::link_follows);
  block_if(!inputs.precharge_is_cool, Blocker::precharge_hot);
  block_if(inputs.now < inputs.locked_out_until, Blocker::locked_out);
  permission.may_close = permission.blockers.empty();
  // The resistor heats up while it is used: PrechargeGuard limits its heat then.
  permission.may_advance = std::all_of(permission.blockers.begin(), permission.blockers.end(), [](Blocker blocker) {
    return blocker == Blocker::not_qualified || blocker == Blocker::precharge_hot;
  });
  // A closed pack tolerates disturbances within a fault's confirm time: one missed poll, one bad sample. The faults
  // that monitor those have their own debounce times; the conditions here have none.
  permission.may_stay_closed = inputs.may_command && inputs.internal_bus_up && inputs.pdu_fresh && !inputs.is_resting &&
                               !any_demands_opening(faults, pack, inputs, config);
  // A fault that only refuses to close does not open a closed pack. A closing in progress is aborted by it, without a
  // wait, and also by a module that has just lost the cell limits: it has restarted, and the precharge timeout would
  // only report a precharge that was too slow.
  permission.may_go_on = permission.may_stay_closed && !any_present(faults, inputs, config) && inputs.modules_set_up;
  permission.may_charge =
      permission.may_stay_closed && !forbids_current(faults, pack, inputs.now, Concerns::charge, config);
  permission.may_discharge =
      permission.may_stay_closed && !forbids_current(faults, pack, inputs.now, Concerns::discharge, config);
  return permission;
}

}  // namespace bmu
