// The cells' health as JSON (daemon/core/estimation/health/cell_health.hpp): of the pack, and of every cell its
// capacity, its resistance, and what is left of both. What is not known is null.
#pragma once

#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// Of the pack, without the cells themselves.
[[nodiscard]] Json pack_health_json(const CoreView& view);

/// The same, and of every module each cell's.
[[nodiscard]] Json health_json(const CoreView& view);

}  // namespace bmu
