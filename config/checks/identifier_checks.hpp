// Whether every protocol of a pack file has its identifiers to itself.
//
// Those of the internal bus nobody else may have, on whatever bus: someone will join two buses on one adapter, and a
// wrong plug must not command contactors. An inverter's are taken all the same, and cannot be moved: those only must
// not be on the internal bus. Others must not meet on one bus.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already refused are not judged.
void check_identifiers(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Identifiers and bit rates (device_rates.hpp) of a pack whose buses have other names than in its file: what was apart
/// may have met.
[[nodiscard]] ConfigProblems bus_clashes(const PackConfig& pack);

}  // namespace bmu
