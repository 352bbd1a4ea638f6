// Check of a script against its pack: targets that the pack does not have, and properties that modules of its
// manufacturer do not have.
#pragma once

#include "mmu/scenario/world.hpp"

namespace bmu {

/// Everything in a script that does not exist in this pack, or not in its modules.
[[nodiscard]] ScenarioProblems check_against(const Scenario& scenario, const SimulatorConfig& config);

/// Adapts identifiers to this pack's bus: with third-party modules, an identifier of MMU frames stands for any frame
/// with that identifier, regardless of its length and checksum.
[[nodiscard]] Scenario meant_for(const SimulatorConfig& config, Scenario scenario);

}  // namespace bmu
