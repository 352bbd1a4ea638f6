// The key "dynamics" of a cell: measured tables, one object for each temperature.
#pragma once

#include <span>

#include "config/fields/fields.hpp"
#include "config/fields/list_fields.hpp"
#include "daemon/core/cell/cell_dynamics.hpp"

namespace bmu {

[[nodiscard]] std::span<const Field<CellDynamics>> dynamics_fields();
[[nodiscard]] std::span<const ListField<CellDynamics>> dynamics_lists();
[[nodiscard]] std::span<const Field<CellDynamics::Row>> dynamics_row_fields();  // of an element of "rows"
[[nodiscard]] std::span<const ListField<CellDynamics::Row>> dynamics_row_lists();

/// Capacity and self-discharge, which are keys of the cell itself, are taken from `model`. The result is valid only if
/// nothing was added to the problems.
[[nodiscard]] CellDynamics read_dynamics(const JsonValue& object, const Place& place, const CellModel& model,
                                         ProblemList& problems);

}  // namespace bmu
