// What no key can say alone: limits against the cell, ages against periods, reactions against budgets, nodes against
// each other. Runs on what was read; a value that was already refused is left out, so that one mistake is one problem.
#pragma once

#include <string_view>

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `pack_place` is the root of the pack file, `cell_place` that of the cell's object, in its own file or in the pack's.
void check_pack(const PackConfig& pack, const Place& pack_place, const Place& cell_place, ProblemList& problems);

/// Of these, what follows from the bit rate of the internal bus: whether the answers fit between two polls at each
/// pace, and the ages.
void check_bus_times(const PackConfig& pack, const Place& pack_place, ProblemList& problems);

/// Nothing to refuse, but worth a warning at the start: full buses, and a charge that waits for more than balancing can
/// do. Of a pack that was read.
[[nodiscard]] ConfigProblems pack_warnings(const PackConfig& pack, std::string_view file_name);

}  // namespace bmu
