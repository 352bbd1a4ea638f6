// The health of the cells as JSON (daemon/core/estimation/health/cell_health.hpp): of the pack, and for every cell its
// capacity, its resistance, and the SOH by both. An unknown value is null.
#pragma once

#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// Of the pack, without the cells themselves.
[[nodiscard]] Json pack_health_json(const CoreView& view);

/// The same, and the values of each cell of every module.
[[nodiscard]] Json health_json(const CoreView& view);

}  // namespace bmu
