// Checks whether the values of a pack file for its inverter can be sent, and may.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already rejected, or are missing, are not checked.
void check_inverter(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Checks that need the defaults of missing keys. Precondition: a pack without problems so far.
void check_completed_inverter(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
