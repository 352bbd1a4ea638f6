// Balancing as JSON: its state, its inhibits, and the values of each cell.
#pragma once

#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// State, reasons, plan and number of bleeding cells, without the cells themselves.
[[nodiscard]] Json balancing_state_json(const CoreView& view);

/// The same, and for every module: the stage of its command, and for every cell the charge to go, its minutes, its
/// switch, the charge bled since the start, and the charge missing until it is full.
[[nodiscard]] Json balance_json(const CoreView& view);

}  // namespace bmu
