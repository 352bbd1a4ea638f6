// bmucell health: scores the capacity estimation on charges and capacity tests.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// Returns the exit code.
[[nodiscard]] int run_health(const HealthOptions& options);

}  // namespace bmu::cell
