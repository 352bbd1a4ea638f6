// Whether a pack file's inverter can be told what it asks for, and may.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already refused, or left out, are not judged.
void check_inverter(const PackConfig& pack, const Place& place, ProblemList& problems);

/// What can only be judged once what was left out has its value. Of a pack without problems so far.
void check_completed_inverter(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
