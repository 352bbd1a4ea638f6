// bmucell resistance: a recording with pulses and their table in, figures out.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// The exit code.
[[nodiscard]] int run_resistance(const ResistanceOptions& options);

}  // namespace bmu::cell
