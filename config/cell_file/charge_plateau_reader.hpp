// The key "charge_plateau" of a cell: the capacity as a function of a complete charge
// (daemon/core/estimation/health/charge_plateau.hpp), as fitted by `bmucell health --fit`.
#pragma once

#include <span>

#include "config/fields/fields.hpp"
#include "daemon/core/estimation/health/charge_plateau.hpp"

namespace bmu {

[[nodiscard]] std::span<const Field<ChargePlateauModel>> charge_plateau_fields();

/// The result is valid only if nothing was added to the problems.
[[nodiscard]] ChargePlateauModel read_charge_plateau(const JsonValue& object, const Place& place,
                                                     ProblemList& problems);

}  // namespace bmu
