// The key "component_limits": ratings of the components that carry the pack current.
#pragma once

#include "config/json/json_reader.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// The result is valid only if nothing was added to the problems.
void read_parts(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems);

/// Checks the currents of the user against each other and against those of the pack, the limp-home current, the ramps,
/// and the full voltage.
void check_bounds(const CoreConfig& core, const Place& root_place, ProblemList& problems);

/// Sets a missing peak current to the continuous current.
void complete_bounds(CoreConfig& core);

}  // namespace bmu
