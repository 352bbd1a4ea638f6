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
    {BalancingBlocker::not_enabled, "not_enabled", "the pack file does not ask for balancing",
     [](const In& in, bool) { return !asked(in).is_enabled; }},
    {BalancingBlocker::switched_off, "switched_off", "switched off; `bmuctl balance --on` ends that",
     [](const In& in, bool) { return in.is_switched_off; }},
    {BalancingBlocker::shutting_down, "shutting_down", "the daemon is shutting down",
     [](const In& in, bool) { return in.is_shutting_down; }},
    {BalancingBlocker::resting, "resting", "the modules are asleep after an undervoltage",
     [](const In& in, bool) { return in.is_resting; }},
    {BalancingBlocker::internal_bus_down, "internal_bus_down", "the internal bus is down",
     [](const In& in, bool) { return !in.internal_bus_up; }},
    {BalancingBlocker::fault, "fault", "a fault is present that is more than a warning",
     [](const In& in, bool) { return in.has_fault; }},
    {BalancingBlocker::incomplete, "incomplete", "not every module, cell and temperature is known and fresh",
     [](const In& in, bool) { return !in.pack->is_complete(); }},
    {BalancingBlocker::not_set_up, "not_set_up", "a module has not taken over the cell limits",
     [](const In& in, bool) { return !in.modules_set_up; }},
    {BalancingBlocker::module_not_normal, "module_not_normal", "a module is not in its normal mode",
     [](const In& in, bool) {
       return any_status(in, [](const ModuleStatus& said) { return said.mode != internal_bus::Mode::normal; });
     }},
    {BalancingBlocker::on_module_supply, "on_module_supply", "a module lives on its own cells",
     [](const In& in, bool) { return any_status(in, [](const ModuleStatus& said) { return said.on_module_supply; }); }},
    {BalancingBlocker::current_unknown, "current_unknown", "the current is not known or not fresh",
     [](const In& in, bool) { return !in.pack->current_mA.is_valid(); }},
    {BalancingBlocker::discharging, "discharging", "the pack is discharged with more than `balancing/discharge_max_mA`",
     is_discharging},
    {BalancingBlocker::moving_contactors, "moving_contactors", "the contactors are being closed or opened",
     [](const In& in, bool) { return in.phase != Phase::open && in.phase != Phase::closed; }},
    {BalancingBlocker::not_closed, "not_closed",
     "the contactors are open, and `balancing/requires_closed` forbids it then",
     [](const In& in, bool) { return asked(in).requires_closed && in.phase == Phase::open; }},
    {BalancingBlocker::cell_too_low, "cell_too_low", "a cell is below `balancing/voltage_min_mV`", is_too_low},
    {BalancingBlocker::board_too_hot, "board_too_hot",
     "a module's board is above `balancing/board_max_dC`, or says it is too hot", is_too_hot},
    {BalancingBlocker::board_too_cold, "board_too_cold", "a module's board is below `balancing/board_min_dC`",
     is_too_cold},
    {BalancingBlocker::board_unknown, "board_unknown",
     "a module has no sensor on its board, and `balancing/without_board_sensor` is false", is_board_unknown},
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
