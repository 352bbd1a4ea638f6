// Whether the contactors may close, whether they may stay closed, and which current may flow then. Starts false, is
// granted here and nowhere else, anew in every tick, and any one reason below takes it away.
//
// What a fault forbids depends on what it concerns and on who asks. A fault that concerns discharging forbids a closed
// pack to a vehicle, not to a charger (BMS_F.10: charged after an undervoltage, and nothing else); one that concerns
// charging forbids it to a charger alone, and the charge contactor to everybody.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

enum class Blocker : std::uint8_t {
  shutting_down,
  fault,    // a present fault that speaks against closing; which ones: fault memory
  resting,  // the modules are asleep after an undervoltage
  internal_bus_down,
  pdu_unknown,          // no fresh PDU_STATUS: nobody would obey
  inputs_unhealthy,     // an emergency stop, interlock or insulation input says no, confirmed as a fault or not
  insulation_unknown,   // the insulation monitor has not told a resistance
  modules_incomplete,   // not every module, cell and temperature is fresh and valid
  sensors_incomplete,   // current, pack or link voltage is not fresh
  not_qualified,        // fewer than the needed complete poll cycles in a row since start, gap or bus loss
  modules_not_set_up,   // a module has not taken over our limits since its restart
  suspicion,            // a value beyond its limit, or a bad sign, that has not lasted long enough to be a fault
  commands_not_on_bus,  // our own contactor commands were not seen on the bus just now
  contacts_unsettled,   // the auxiliary contacts have not yet stood where they were told to for long enough
  contactor_closed,     // an auxiliary contact is closed although everything is commanded open
  link_follows,         // the link is at the pack's voltage before any precharge
  precharge_hot,        // the precharge resistor has to cool before it may be used again
  locked_out,           // a wait after an opening by fault or a failed precharge
  no_claim,             // listening for another master of this pack, or there is one
};
inline constexpr std::size_t blocker_count = 19;

[[nodiscard]] std::string_view to_text(Blocker blocker);

/// Who asks for a closed pack. Nobody: judged as if the vehicle did.
struct Wish {
  bool by_vehicle = false;
  bool by_charger = false;
};

struct PermissionInputs {
  TimePoint now{};
  Wish wish;
  bool is_plugged_in = false;  // a charger
  bool is_shutting_down = false;
  bool is_resting = false;
  bool may_command = false;  // no other master was received (master_claim.hpp)
  bool internal_bus_up = false;
  bool pdu_fresh = false;
  bool inputs_healthy = false;
  bool insulation_known = false;
  bool modules_set_up = false;
  bool commands_are_on_bus = false;
  bool contacts_settled = false;
  bool contactor_closed_though_open = false;
  bool link_follows_though_open = false;
  bool precharge_is_cool = false;
  std::uint32_t complete_cycles = 0;
  TimePoint locked_out_until{};
};

/// Complete poll cycles in a row before a fresh start counts as a full view of the pack.
inline constexpr std::uint32_t qualifying_cycles = 3;

struct Permission {
  bool may_close = false;        // every reason below is absent
  bool may_advance = false;      // the same for a closing under way, which a lost frame may not break off
  bool may_go_on = false;        // with a closing under way: as a closed pack, no fault is present at all, and every
                                 // module still has our limits
  bool may_stay_closed = false;  // those that matter to a closed pack are absent
  bool may_charge = false;       // within a closed pack
  bool may_discharge = false;
  FixedVector<Blocker, blocker_count> blockers;  // reasons against closing, most important first
};

/// Whether the fault, once it is present, forbids a closed pack to who asks.
[[nodiscard]] bool speaks_against(Concerns concerns, const Wish& wish);
/// A present fault opens a pack that is closed for who asks, at once or when its grace is over.
[[nodiscard]] bool opens_for(const FaultRow& row, const FaultState& state, const Wish& wish,
                             const StricterReactions& stricter);
/// A present fault keeps an open pack open, whoever asks for it to be closed. `is_plugged_in`: a charger.
[[nodiscard]] bool keeps_open_for(const FaultRow& row, const FaultState& state, const Wish& wish, bool is_plugged_in,
                                  const StricterReactions& stricter);
/// More than the contactors break may flow for so long once a fault of current or cell voltage is confirmed, whatever
/// the sensor says: then they open.
inline constexpr Duration break_wait_max = 250ms;

/// More current flows than the contactors break, the row waits for it to fall, and the wait is not over. A current that
/// is not known does not wait, and neither does a pack whose file does not say what its contactors break.
[[nodiscard]] bool waits_for_break(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now,
                                   const ContactorConfig& contactors);
/// A fault with a grace takes the permission when its grace is over or the current has fallen; one that opens at once
/// may wait for its current (waits_for_break).
[[nodiscard]] bool demands_opening(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now,
                                   const CoreConfig& config);
/// A fault with a grace, or one that may wait for its current, present, that concerns this current: its limit must be
/// zero already.
[[nodiscard]] bool demands_zero_current(const FaultMemory& faults, Concerns direction, const CoreConfig& config);

/// A present fault forbids this current, and this one only, while the pack may stay closed for the other.
[[nodiscard]] bool forbids(const FaultMemory& faults, Concerns direction);

[[nodiscard]] Permission evaluate_permission(const PermissionInputs& inputs, const PackState& pack,
                                             const FaultMemory& faults, const CoreConfig& config);

}  // namespace bmu
