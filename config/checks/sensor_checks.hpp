// Checks the settings of a pack file's sensors and insulation monitor against each other.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already rejected are not checked.
void check_sensors_of_others(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
