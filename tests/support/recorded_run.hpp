// A recording of a core and an emulated pack in virtual time, for whoever reads recordings.
#pragma once

#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "daemon/recording/record_writer.hpp"
#include "mmu/scenario.hpp"
#include "tests/support/catch.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu::test {

/// 2023-11-14 22:13:20 UTC, when each of them begins.
inline constexpr std::int64_t recorded_from_us = 1'700'000'000'000'000;

inline PackConfig demo_pack() {
  auto pack = load_pack_config(std::string(BMUD_SOURCE_DIR) + "/config/packs/demo-48s.json");
  REQUIRE(pack);
  return *pack;
}

/// The demonstration's pack for so long, by a script.
inline std::string recorded_run(std::string_view script, Duration length, std::int64_t from_us = recorded_from_us) {
  const PackConfig pack = demo_pack();
  auto scenario = parse_scenario(script, core_vocabulary());
  REQUIRE(scenario);
  VirtualRun run(pack.core, simulator_config(pack.core), *scenario);
  RecordWriter writer({.version = "0.1.0",
                       .buses = {.internal = "vcan0", .vehicle = "vcan0"},
                       .sources = pack.sources,
                       .hash = pack.core.hash});
  writer.begin(run.core(), run.now(), from_us);
  run.set_tap(&writer);
  while (run.elapsed() < length) run.step();
  return writer.text();
}

}  // namespace bmu::test
