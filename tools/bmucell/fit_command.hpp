// bmucell fit: recordings in, a cell file out.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// The exit code.
[[nodiscard]] int run_fit(const FitOptions& options);

}  // namespace bmu::cell
