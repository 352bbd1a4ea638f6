// Checks of keys against each other: limits against the cell, ages against periods, reactions against budgets, nodes
// against each other. Runs on what was read; a value that was already rejected is not checked, so that one mistake is
// one problem.
#pragma once

#include <string_view>

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// `pack_place` is the root of the pack file, `cell_place` that of the cell's object, in its own file or in the pack's.
void check_pack(const PackConfig& pack, const Place& pack_place, const Place& cell_place, ProblemList& problems);

/// The part of these checks that depends on the bit rates: whether the answers fit between two polls at each poll
/// period, the load of the buses without modules, and the ages.
void check_bus_times(const PackConfig& pack, const Place& pack_place, ProblemList& problems);

/// Warnings at the start that do not reject the pack: full buses, and a charge that waits for more than balancing can
/// do. Precondition: the pack was read.
[[nodiscard]] ConfigProblems pack_warnings(const PackConfig& pack, std::string_view file_name);

}  // namespace bmu
