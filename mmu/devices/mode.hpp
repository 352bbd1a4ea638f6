// Operating mode of a module, and its transitions.
//
//   asleep --traffic--> starting --first average--> normal <------- master or external supply ------- autonomous
//      ^                                              |  \                                              /  |
//      |                                              |   `- on module supply, no POLL for 1 s --------'   |
//      +------------- going_to_sleep <----ordered-----+              nothing (more) to balance ------------+
//
//   any awake one --no supply left--> unpowered, which ends with a supply, as a restart
//
// Normal: the master commands the balancing; on either supply, since a module that the master polls is worth the energy
// it takes. Autonomous (MMU_A): on module supply and without a master it finishes the commanded balancing, then
// balances autonomously if this is permitted, and sleeps when there is nothing more to do. Asleep, only traffic on the
// bus has an effect: the module changes to `starting`.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "mmu/devices/supply.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

enum class UnitMode : std::uint8_t { starting, normal, autonomous, going_to_sleep, asleep, unpowered };

struct UnitModeInputs {
  bool has_voltages = false;  // since it started or woke
  bool is_master_alive = false;
  SupplyInUse supply = SupplyInUse::external;
  bool has_listened_in_vain = false;  // woken by traffic, and no master until the timeout
  bool is_sleep_ordered = false;
  bool is_quiet = false;  // everything was sent, and enough time for that has elapsed
  bool has_balancing_to_do = false;
};

[[nodiscard]] constexpr UnitMode next_mode(UnitMode mode, const UnitModeInputs& in) {
  using enum UnitMode;
  const bool is_alone = in.supply == SupplyInUse::module && !in.is_master_alive;
  const UnitMode awake = in.has_voltages ? normal : starting;
  if (mode == asleep || mode == unpowered) return mode;
  if (in.supply == SupplyInUse::none) return unpowered;
  if (in.has_listened_in_vain) return asleep;
  switch (mode) {
    case starting:
    case normal:
      if (in.is_sleep_ordered) return going_to_sleep;
      return is_alone ? autonomous : awake;
    case autonomous:
      if (in.is_sleep_ordered || (is_alone && !in.has_balancing_to_do)) return going_to_sleep;
      return is_alone ? autonomous : awake;
    case going_to_sleep:
      if (!in.is_sleep_ordered && !is_alone) return awake;
      return in.is_quiet ? asleep : going_to_sleep;
    case asleep:
    case unpowered: break;
  }
  return mode;
}

/// Names as in STATUS, in the order of the enumerators.
inline constexpr std::array<std::string_view, 6> unit_mode_names{"starting",       "normal", "autonomous",
                                                                 "going_to_sleep", "asleep", "unpowered"};

/// Mode as in STATUS; asleep and unpowered, no STATUS is sent.
[[nodiscard]] constexpr internal_bus::Mode on_the_wire(UnitMode mode) {
  const bool is_awake = mode < UnitMode::asleep;
  return is_awake ? static_cast<internal_bus::Mode>(mode) : internal_bus::Mode::going_to_sleep;
}
static_assert(on_the_wire(UnitMode::starting) == internal_bus::Mode::starting);
static_assert(on_the_wire(UnitMode::normal) == internal_bus::Mode::normal);
static_assert(on_the_wire(UnitMode::autonomous) == internal_bus::Mode::autonomous);
static_assert(on_the_wire(UnitMode::going_to_sleep) == internal_bus::Mode::going_to_sleep);

namespace mode_rules {

using enum UnitMode;
inline constexpr UnitMode awake_modes[] = {starting, normal, autonomous, going_to_sleep};

[[nodiscard]] constexpr bool all_awake_go_to(UnitMode wanted, const UnitModeInputs& in) {
  for (const UnitMode mode : awake_modes) {
    if (next_mode(mode, in) != wanted) return false;
  }
  return true;
}
static_assert(all_awake_go_to(normal, {.has_voltages = true}), "on external supply nobody needs to call");
static_assert(all_awake_go_to(starting, {.is_master_alive = true}));
static_assert(all_awake_go_to(normal, {.has_voltages = true, .is_master_alive = true, .supply = SupplyInUse::module}),
              "whatever feeds it, a unit answers its master");
static_assert(all_awake_go_to(unpowered, {.is_master_alive = true, .supply = SupplyInUse::none}));
static_assert(all_awake_go_to(asleep, {.has_listened_in_vain = true, .has_balancing_to_do = true}));
static_assert(next_mode(asleep, {.has_voltages = true, .is_master_alive = true}) == asleep, "only traffic wakes");
static_assert(next_mode(autonomous, {.supply = SupplyInUse::module, .has_balancing_to_do = true}) == autonomous);
static_assert(next_mode(autonomous, {.supply = SupplyInUse::module}) == going_to_sleep);
static_assert(next_mode(normal, {.has_voltages = true, .is_master_alive = true, .is_sleep_ordered = true}) ==
              going_to_sleep);
static_assert(next_mode(going_to_sleep, {.is_master_alive = true, .is_sleep_ordered = true, .is_quiet = true}) ==
                  asleep,
              "an order holds while the master goes on");

}  // namespace mode_rules

}  // namespace bmu
