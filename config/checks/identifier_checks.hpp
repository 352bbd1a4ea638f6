// Checks that every protocol of a pack file has its identifiers to itself.
//
// No other protocol may use those of the internal bus, on any bus: two buses may be joined on one adapter, and a wrong
// plug must not command contactors. Those of an inverter coincide with them nevertheless and cannot be moved: they only
// must not be on the internal bus. Other protocols must not share identifiers on one bus.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already rejected are not checked.
void check_identifiers(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Problems with identifiers and bit rates (device_rates.hpp) of a pack with other names of buses than in its file:
/// protocols of separate buses may now share one.
[[nodiscard]] ConfigProblems bus_clashes(const PackConfig& pack);

}  // namespace bmu
