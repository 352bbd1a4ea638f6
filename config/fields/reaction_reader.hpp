// The key "faults": what a fault does in this pack, where that is more than the fault table has it do.
#pragma once

#include "config/json/json_reader.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Fills `core.stricter_reactions`; an entry with a problem is left out. A weaker reaction is a problem, and so is one
/// for a fault that cannot be stricter.
void read_reactions(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems);

/// A fault that opens only because this file has it do so is confirmed, and its grace is over, within the budget of
/// faults that open in every pack. Faults of limits have their budget in their own rows (LimitRow::reaction_max).
void check_reaction_times(const CoreConfig& core, const Place& root_place, ProblemList& problems);

}  // namespace bmu
