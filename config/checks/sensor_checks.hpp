// Whether a pack file's sensors and insulation monitor can be what it says of them.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already refused are not judged.
void check_sensors_of_others(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
