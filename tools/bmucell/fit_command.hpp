// bmucell fit: fits a cell file to recordings.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// Returns the exit code.
[[nodiscard]] int run_fit(const FitOptions& options);

}  // namespace bmu::cell
