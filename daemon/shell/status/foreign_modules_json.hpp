// Report on modules of another maker: their type, and the capabilities they lack.
#pragma once

#include "daemon/shell/status/status_view.hpp"

namespace bmu {

/// {"protocol", "title", "bleed_above_mV" (null: nothing is bled), "cannot": sentences}; null for modules with the
/// daemon's own protocol.
[[nodiscard]] Json foreign_modules_json(const CoreView& view);

}  // namespace bmu
