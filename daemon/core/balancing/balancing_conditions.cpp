#include "daemon/core/balancing/balancing_conditions.hpp"

#include <algorithm>
#include <bit>

#include "protocol/assert.hpp"
#include "protocol/row_order.hpp"

namespace bmu {

namespace {

using In = BalancingConditions;

constexpr std::int32_t voltage_hysteresis_uV = 20'000;
constexpr std::int32_t temperature_hysteresis_dC = 50;
constexpr std::int32_t current_hysteresis_share = 5;

const BalancingConfig& asked(const In& in) {
  return in.config->balancing;
}

/// Checks the modules with a valid status; the others make the pack incomplete.
template <class Says>
bool any_status(const In& in, Says says) {
  const auto& modules = in.modules->modules();
  return std::any_of(modules.begin(), modules.end(), [&says](const ModuleRecord& module) {
    return module.status.is_valid() && says(module.status.value);
  });
}

bool is_too_low(const In& in, bool held) {
  const Spread& cells = in.pack->cell_voltage_uV;
  return cells.is_known() && cells.min < asked(in).voltage_min_uV + (held ? voltage_hysteresis_uV : 0);
}

bool is_too_hot(const In& in, bool held) {
  const Spread& boards = in.pack->board_temperature_dC;
  const std::int32_t from_dC = asked(in).board_max_dC - (held ? temperature_hysteresis_dC : 0);
  return (boards.is_known() && boards.max > from_dC) ||
         any_status(in, [](const ModuleStatus& said) { return said.board_too_hot; });
}

bool is_too_cold(const In& in, bool held) {
  const Spread& boards = in.pack->board_temperature_dC;
  return boards.is_known() && boards.min < asked(in).board_min_dC + (held ? temperature_hysteresis_dC : 0);
}

/// A module without a board sensor; before its first report the pack is incomplete, too.
bool is_board_unknown(const In& in, bool) {
  const auto& modules = in.modules->modules();
  return !asked(in).without_board_sensor &&
         std::any_of(modules.begin(), modules.end(), [](const ModuleRecord& one) { return one.fitted_boards == 0; });
}

bool is_discharging(const In& in, bool held) {
  const std::int32_t most_mA = asked(in).discharge_max_mA;
  const std::int32_t from_mA = most_mA - (held ? most_mA / current_hysteresis_share : 0);
  return in.pack->current_mA.is_valid() && in.pack->current_mA.value > from_mA;
}

constexpr std::array<BalancingBlockerRow, balancing_blocker_count> table{{
    {BalancingBlocker::not_enabled, "not_enabled", "balancing not enabled in the pack file",
     [](const In& in, bool) { return !asked(in).is_enabled; }},
    {BalancingBlocker::switched_off, "switched_off",
     "switched off by an operator; switch on with `bmuctl balance --on`",
     [](const In& in, bool) { return in.is_switched_off; }},
    {BalancingBlocker::shutting_down, "shutting_down", "daemon shutting down",
     [](const In& in, bool) { return in.is_shutting_down; }},
    {BalancingBlocker::resting, "resting", "modules asleep after an undervoltage",
     [](const In& in, bool) { return in.is_resting; }},
    {BalancingBlocker::internal_bus_down, "internal_bus_down", "internal bus down",
     [](const In& in, bool) { return !in.internal_bus_up; }},
    {BalancingBlocker::fault, "fault", "fault with a reaction above \"warn\" confirmed",
     [](const In& in, bool) { return in.has_fault; }},
    {BalancingBlocker::incomplete, "incomplete", "module data incomplete or stale",
     [](const In& in, bool) { return !in.pack->is_complete(); }},
    {BalancingBlocker::not_set_up, "not_set_up", "cell limits not acknowledged by a module",
     [](const In& in, bool) { return !in.modules_set_up; }},
    {BalancingBlocker::module_not_normal, "module_not_normal", "module not in normal mode",
     [](const In& in, bool) {
       return any_status(in, [](const ModuleStatus& said) { return said.mode != internal_bus::Mode::normal; });
     }},
    {BalancingBlocker::on_module_supply, "on_module_supply", "module powered by its own cells",
     [](const In& in, bool) { return any_status(in, [](const ModuleStatus& said) { return said.on_module_supply; }); }},
    {BalancingBlocker::current_unknown, "current_unknown", "pack current unknown or stale",
     [](const In& in, bool) { return !in.pack->current_mA.is_valid(); }},
    {BalancingBlocker::discharging, "discharging", "discharge current above `balancing/discharge_max_mA`",
     is_discharging},
    {BalancingBlocker::moving_contactors, "moving_contactors", "contactors switching",
     [](const In& in, bool) { return in.phase != Phase::open && in.phase != Phase::closed; }},
    {BalancingBlocker::not_closed, "not_closed", "contactors open and `balancing/requires_closed` set",
     [](const In& in, bool) { return asked(in).requires_closed && in.phase == Phase::open; }},
    {BalancingBlocker::cell_too_low, "cell_too_low", "cell voltage below `balancing/voltage_min_mV`", is_too_low},
    {BalancingBlocker::board_too_hot, "board_too_hot",
     "board temperature above `balancing/board_max_dC`, or reported too hot by the module", is_too_hot},
    {BalancingBlocker::board_too_cold, "board_too_cold", "board temperature below `balancing/board_min_dC`",
     is_too_cold},
    {BalancingBlocker::board_unknown, "board_unknown",
     "module without board sensor and `balancing/without_board_sensor` not set", is_board_unknown},
}};

static_assert(rows_are_in_order(table, &BalancingBlockerRow::id));

}  // namespace

const std::array<BalancingBlockerRow, balancing_blocker_count>& balancing_blocker_table() {
  return table;
}

const BalancingBlockerRow& row_of(BalancingBlocker id) {
  BMU_ASSERT(static_cast<std::size_t>(id) < table.size());
  return table[static_cast<std::size_t>(id)];
}

BalancingBlockers balancing_blockers(const BalancingConditions& conditions, BalancingBlockers before) {
  BalancingBlockers blockers = 0;
  for (std::size_t index = 0; index < table.size(); ++index) {
    const BalancingBlockers bit = 1U << index;
    if (table[index].holds(conditions, (before & bit) != 0)) blockers |= bit;
  }
  return blockers;
}

BalancingBlocker first_of(BalancingBlockers blockers) {
  BMU_ASSERT(blockers != 0);
  return static_cast<BalancingBlocker>(std::countr_zero(blockers));
}

}  // namespace bmu
