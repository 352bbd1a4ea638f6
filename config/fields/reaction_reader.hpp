// The key "faults": reactions of this pack that are stricter than those of the fault table.
#pragma once

#include "config/json/json_reader.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Fills `core.stricter_reactions`; an entry with a problem is omitted. A weaker reaction is a problem, as is one for a
/// fault that cannot be stricter.
void read_reactions(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems);

/// Checks that a fault that opens only because of this file is confirmed, and its grace over, within the budget of
/// faults that open in every pack. Faults of limits have their budget in their own rows (LimitRow::reaction_max).
void check_reaction_times(const CoreConfig& core, const Place& root_place, ProblemList& problems);

}  // namespace bmu
