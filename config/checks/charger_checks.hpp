// Whether a pack file's chargers can do what it asks of them, and may.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already refused, or left out, are not judged.
void check_charger(const PackConfig& pack, const Place& place, ProblemList& problems);

/// What can only be judged once what was left out has its value. Of a pack without problems so far.
void check_completed_charger(const PackConfig& pack, const Place& place, ProblemList& problems);

/// A window of full cells that is narrower than what balancing leaves. Of a pack that was read.
void warn_of_balance_window(const PackConfig& pack, const Place& place, ProblemList& warnings);

}  // namespace bmu
