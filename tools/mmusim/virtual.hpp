// A run without a bus, as fast as this machine can: the emulated pack in virtual time, alone or with the daemon's core
// beside it in this process.
//
// It ends with the script's verdict, --seconds, a stop signal or, without --seconds, when the script is over. On a
// terminal it shows on standard error how far it is.
#pragma once

#include "config/pack_config.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tools/mmusim/options.hpp"
#include "tools/mmusim/result.hpp"

namespace bmu::sim {

/// SIGINT and SIGTERM must be blocked. The exit code.
[[nodiscard]] int run_virtual(const Options& options, const PackConfig& pack, const SimulatorConfig& config,
                              Scenario scenario);

}  // namespace bmu::sim
