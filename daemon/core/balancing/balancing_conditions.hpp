// Conditions that inhibit balancing: one row for each, with its name and meaning. Any one that applies stops all
// balancing at once.
//
// Thresholds are those of the pack file's section `balancing`; a value that has passed one must return by a hysteresis
// before it counts as ok again.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

enum class BalancingBlocker : std::uint8_t {
  not_enabled,
  switched_off,
  shutting_down,
  resting,
  internal_bus_down,
  fault,
  incomplete,
  not_set_up,
  module_not_normal,
  on_module_supply,
  current_unknown,
  discharging,
  moving_contactors,
  not_closed,
  cell_too_low,
  board_too_hot,
  board_too_cold,
  board_unknown,
};
inline constexpr std::size_t balancing_blocker_count = 18;

struct BalancingConditions {
  const CoreConfig* config = nullptr;
  const PackState* pack = nullptr;
  const ModuleTable* modules = nullptr;
  Phase phase = Phase::open;
  bool is_switched_off = false;  // by command
  bool is_shutting_down = false;
  bool is_resting = false;
  bool internal_bus_up = false;
  bool has_fault = false;  // present, and more than a warning
  bool modules_set_up = false;
};

struct BalancingBlockerRow {
  BalancingBlocker id;
  std::string_view name;     // for machines
  std::string_view meaning;  // for people
  /// `held`: it applied a tick before.
  bool (*holds)(const BalancingConditions&, bool held);
};

/// In the order of BalancingBlocker, the most informative first.
[[nodiscard]] const std::array<BalancingBlockerRow, balancing_blocker_count>& balancing_blocker_table();
[[nodiscard]] const BalancingBlockerRow& row_of(BalancingBlocker id);

/// One bit for each row that applies, the first in the lowest bit.
using BalancingBlockers = std::uint32_t;

[[nodiscard]] BalancingBlockers balancing_blockers(const BalancingConditions& conditions, BalancingBlockers before);

/// The first of them. Precondition: there is one.
[[nodiscard]] BalancingBlocker first_of(BalancingBlockers blockers);

}  // namespace bmu
