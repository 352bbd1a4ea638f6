// bmucell eval: scores the estimators on recordings.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// Returns the exit code.
[[nodiscard]] int run_eval(const EvalOptions& options);

}  // namespace bmu::cell
