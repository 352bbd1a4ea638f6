// Limits that no pack of this kind ever reaches, or that guard nothing: as contradictory as two that cross each other.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file. A value that was already refused is left out, and so is what was judged with
/// it.
void check_limit_bounds(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
