// What is told of modules of another maker: whose they are, and what they cannot do.
#pragma once

#include "daemon/shell/status/status_view.hpp"

namespace bmu {

/// {"protocol", "title", "bleed_above_mV" (null: nothing is bled), "cannot": sentences}; null where the modules are
/// ours.
[[nodiscard]] Json foreign_modules_json(const CoreView& view);

}  // namespace bmu
