// Checks whether the chargers of a pack file are able, and permitted, to do what the pack requires of them.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already rejected, or are missing, are not checked.
void check_charger(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Checks that need the defaults of missing keys. Precondition: a pack without problems so far.
void check_completed_charger(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Warns of a window of full cells that is narrower than what balancing leaves. Precondition: the pack was read.
void warn_of_balance_window(const PackConfig& pack, const Place& place, ProblemList& warnings);

}  // namespace bmu
