// bmucell resistance: scores the resistance estimation on a recording with pulses and their table.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// Returns the exit code.
[[nodiscard]] int run_resistance(const ResistanceOptions& options);

}  // namespace bmu::cell
