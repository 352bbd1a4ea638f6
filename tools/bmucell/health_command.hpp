// bmucell health: charges and capacity tests in, figures out.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// The exit code.
[[nodiscard]] int run_health(const HealthOptions& options);

}  // namespace bmu::cell
