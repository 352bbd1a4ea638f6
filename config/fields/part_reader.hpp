// The key "component_limits": what the parts bear that the whole current flows through.
#pragma once

#include "config/json/json_reader.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Good only where nothing was added to the problems.
void read_parts(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems);

/// What the currents of parts and user must be beside each other and beside those of the pack.
void check_bounds(const CoreConfig& core, const Place& root_place, ProblemList& problems);

/// A peak that is left out is the continuous current.
void complete_bounds(CoreConfig& core);

}  // namespace bmu
