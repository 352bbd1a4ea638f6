// bmucell eval: recordings in, figures out.
#pragma once

#include "tools/bmucell/options.hpp"

namespace bmu::cell {

/// The exit code.
[[nodiscard]] int run_eval(const EvalOptions& options);

}  // namespace bmu::cell
