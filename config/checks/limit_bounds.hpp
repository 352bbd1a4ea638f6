// Checks for limits that no pack of this kind ever reaches, or without effect: as contradictory as two that cross each
// other.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file. A value that was already rejected is not checked, nor is one that depends on
/// it.
void check_limit_bounds(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
