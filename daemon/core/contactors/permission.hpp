// Permission for the contactors to close and to stay closed, and for each direction of current. Denied at start,
// granted only here, evaluated again in every tick; any one inhibit below withdraws it.
//
// The effect of a fault depends on the current that it affects and on the source of the close request. A fault that
// affects discharging inhibits a closed pack for a vehicle, not for a charger (BMS_F.10: charged after an undervoltage,
// and nothing else); one that affects charging inhibits it for a charger alone, and the charge contactor in any case.
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
  fault,    // a confirmed fault that inhibits closing; which ones: fault memory
  resting,  // the modules are asleep after an undervoltage
  internal_bus_down,
  pdu_unknown,          // no fresh PDU_STATUS or GPIO inputs: no node would follow a command
  inputs_unhealthy,     // an emergency stop, interlock or insulation input is tripped, confirmed as a fault or not
  insulation_unknown,   // the insulation monitor has not reported a resistance
  modules_incomplete,   // not every module, cell and temperature is fresh and valid
  sensors_incomplete,   // current, pack or DC link voltage is not fresh
  not_qualified,        // fewer than `qualifying_cycles` complete poll cycles in a row since start, stall or bus loss
  modules_not_set_up,   // a module has not acknowledged the cell limits since its restart
  suspicion,            // a fault is pending: a value beyond its limit that has not lasted long enough to be confirmed
  commands_not_on_bus,  // the contactor commands of this node are not echoed at present
  contacts_unsettled,   // the auxiliary contacts have not yet matched the commands for long enough
  contactor_closed,     // an auxiliary contact is closed although all contactors are commanded open
  link_follows,         // the DC link is at pack voltage before any precharge
  precharge_hot,        // the precharge resistor has to cool before it may be used again
  locked_out,           // lockout or delay after an opening (reclosing.hpp)
  no_claim,             // listening for another master of this pack, or there is one
};
inline constexpr std::size_t blocker_count = 19;

[[nodiscard]] std::string_view to_text(Blocker blocker);

/// Source of the close request. None: evaluated as if the vehicle requested.
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

/// Complete poll cycles in a row after which the view of the pack counts as complete after a start.
inline constexpr std::uint32_t qualifying_cycles = 3;

struct Permission {
  bool may_close = false;        // no inhibit applies
  bool may_advance = false;      // the same for a closing in progress, which a lost frame must not abort
  bool may_go_on = false;        // for a closing in progress: as for a closed pack, no fault inhibits closing, and
                                 // every module still has the cell limits
  bool may_stay_closed = false;  // no inhibit that matters to a closed pack applies
  bool may_charge = false;       // in a closed pack
  bool may_discharge = false;
  FixedVector<Blocker, blocker_count> blockers;  // inhibits of closing, most important first
};

/// Whether a fault with this affected current, once confirmed, inhibits a closed pack for the source of the request.
[[nodiscard]] bool speaks_against(Concerns concerns, const Wish& wish);
/// A confirmed fault opens a pack that is closed for this request, immediately or when its grace has elapsed.
[[nodiscard]] bool opens_for(const FaultRow& row, const FaultState& state, const Wish& wish,
                             const StricterReactions& stricter);
/// A confirmed fault keeps an open pack open for this request. `is_plugged_in`: a charger.
[[nodiscard]] bool keeps_open_for(const FaultRow& row, const FaultState& state, const Wish& wish, bool is_plugged_in,
                                  const StricterReactions& stricter);
/// Maximum time for which more current than the contactors can break may flow once a fault of current or cell voltage
/// is confirmed, whatever the sensor reports: then they open.
inline constexpr Duration break_wait_max = 250ms;

/// More current flows than the contactors can break, the row waits for it to fall, and the wait is not over. An unknown
/// current does not wait, and neither does a pack with a pack file that does not give the breaking capacity.
[[nodiscard]] bool waits_for_break(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now,
                                   const ContactorConfig& contactors);
/// A fault with a grace withdraws the permission when its grace has elapsed or the current has fallen or is unknown;
/// one that opens immediately may wait for its current (waits_for_break).
[[nodiscard]] bool demands_opening(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now,
                                   const CoreConfig& config);
/// A confirmed fault with a grace, or one that may wait for its current, affects this current: its limit must be zero
/// already.
[[nodiscard]] bool demands_zero_current(const FaultMemory& faults, Concerns direction, const CoreConfig& config);

/// A confirmed fault inhibits this current, and this one only, while the pack may stay closed for the other.
[[nodiscard]] bool forbids(const FaultMemory& faults, Concerns direction);

[[nodiscard]] Permission evaluate_permission(const PermissionInputs& inputs, const PackState& pack,
                                             const FaultMemory& faults, const CoreConfig& config);

}  // namespace bmu
