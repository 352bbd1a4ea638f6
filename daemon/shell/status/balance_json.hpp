// Balancing as JSON: what it does, what speaks against it, and each cell's part in it.
#pragma once

#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// State, reasons, plan and how many cells bleed, without the cells themselves.
[[nodiscard]] Json balancing_state_json(const CoreView& view);

/// The same, and of every module: how far it is with its minutes, and of every cell the charge to go, its minutes, its
/// switch, the charge bled since the start, and what is missing until it is full.
[[nodiscard]] Json balance_json(const CoreView& view);

}  // namespace bmu
