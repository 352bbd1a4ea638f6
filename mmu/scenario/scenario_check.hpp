// A script against the pack that it is for: what it names and the pack does not have, and what modules of that maker
// cannot do.
#pragma once

#include "mmu/scenario/world.hpp"

namespace bmu {

/// What in a script does not exist in this pack, or cannot be of its modules.
[[nodiscard]] ScenarioProblems check_against(const Scenario& scenario, const SimulatorConfig& config);

/// Identifiers as they are meant on this pack's bus: where the modules are another maker's, one that frames of our
/// modules have is any frame with that identifier, whatever its length and checksum.
[[nodiscard]] Scenario meant_for(const SimulatorConfig& config, Scenario scenario);

}  // namespace bmu
