// The key "charge_plateau" of a cell: what a whole charge says of its capacity
// (daemon/core/estimation/health/charge_plateau.hpp), as `bmucell health --fit` finds it.
#pragma once

#include <span>

#include "config/fields/fields.hpp"
#include "daemon/core/estimation/health/charge_plateau.hpp"

namespace bmu {

[[nodiscard]] std::span<const Field<ChargePlateauModel>> charge_plateau_fields();

/// Good only where nothing was added to the problems.
[[nodiscard]] ChargePlateauModel read_charge_plateau(const JsonValue& object, const Place& place,
                                                     ProblemList& problems);

}  // namespace bmu
