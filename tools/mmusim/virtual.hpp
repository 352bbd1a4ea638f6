// A run without a bus, at the maximum speed of the machine: the emulated pack in virtual time, alone or with the
// daemon's core in the same process.
//
// It ends with the script's verdict, --seconds, a stop signal or, without --seconds, when the script is over. On a
// terminal it shows its progress on standard error.
#pragma once

#include "config/pack_config.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tools/mmusim/options.hpp"
#include "tools/mmusim/result.hpp"

namespace bmu::sim {

/// Precondition: SIGINT and SIGTERM are blocked. Returns the exit code.
[[nodiscard]] int run_virtual(const Options& options, const PackConfig& pack, const SimulatorConfig& config,
                              Scenario scenario);

}  // namespace bmu::sim
