// Whether the contactors may close, and whether they may stay closed. Starts false, is granted here and nowhere else,
// anew in every tick, and any one reason below takes it away.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/fault_memory.hpp"
#include "daemon/core/pack_state.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

enum class Blocker : std::uint8_t {
  shutting_down,
  fault,  // a present fault that opens; which ones: fault memory
  internal_bus_down,
  pdu_unknown,          // no fresh PDU_STATUS: nobody would obey
  inputs_unhealthy,     // an emergency stop, interlock or insulation input says no, confirmed as a fault or not
  modules_incomplete,   // not every module, cell and temperature is fresh and valid
  sensors_incomplete,   // current, pack or link voltage is not fresh
  not_qualified,        // fewer than the needed complete poll cycles in a row since start, gap or bus loss
  modules_not_set_up,   // a module has not taken over our limits since its restart
  suspicion,            // a value beyond its limit, or a bad sign, that has not lasted long enough to be a fault
  commands_not_on_bus,  // our own contactor commands were not seen on the bus just now
  contacts_unsettled,   // the auxiliary contacts have not yet stood where they were told to for long enough
  contactor_closed,     // an auxiliary contact is closed although everything is commanded open
  locked_out,           // a wait after an opening by fault or a failed precharge
};
inline constexpr std::size_t blocker_count = 14;

[[nodiscard]] std::string_view to_text(Blocker blocker);

struct PermissionInputs {
  TimePoint now{};
  bool is_shutting_down = false;
  bool internal_bus_up = false;
  bool pdu_fresh = false;
  bool inputs_healthy = false;
  bool modules_set_up = false;
  bool commands_are_on_bus = false;
  bool contacts_settled = false;
  bool contactor_closed_though_open = false;
  std::uint32_t complete_cycles = 0;
  TimePoint locked_out_until{};
};

/// Complete poll cycles in a row before a fresh start counts as a full view of the pack.
inline constexpr std::uint32_t qualifying_cycles = 3;

struct Permission {
  bool may_close = false;        // every reason below is absent
  bool may_advance = false;      // the same for a closing under way, which a lost frame may not break off
  bool may_stay_closed = false;  // those that matter to a closed pack are absent
  FixedVector<Blocker, blocker_count> blockers;  // reasons against closing, most important first
};

/// The largest current at which a fault with a grace opens early: what contactors break without wear.
inline constexpr std::int32_t small_current_mA = 1'000;

/// A fault with a grace takes the permission when its grace is over or the current has fallen.
[[nodiscard]] bool demands_opening(const FaultRow& row, const FaultState& state, const PackState& pack, TimePoint now);
/// A fault with a grace, present: limits must be zero already.
[[nodiscard]] bool demands_zero_current(const FaultMemory& faults);

[[nodiscard]] Permission evaluate_permission(const PermissionInputs& inputs, const PackState& pack,
                                             const FaultMemory& faults);

}  // namespace bmu
