// A recording of a core and an emulated pack in virtual time, for tests of readers of recordings.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "daemon/recording/record_writer.hpp"
#include "mmu/scenario/scenario.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu::test {

/// 2023-11-14 22:13:20 UTC, the start of each of them.
inline constexpr std::int64_t recorded_from_us = 1'700'000'000'000'000;

inline PackConfig demo_pack() {
  auto pack = load_pack_config(test::in_source("config/packs/demo-48s.json"));
  REQUIRE(pack);
  return *pack;
}

struct RecordedRun {
  Duration length{};
  Duration begin_after{};                  // nothing before is recorded
  Duration part_length = Duration::max();  // a new part starts after so long, as in the daemon
  std::int64_t from_us = recorded_from_us;
  std::int64_t clock_behind_us = 0;  // with each part the wall clock is set back by this
  Duration clock_set_at{};           // the wall clock is set then,
  std::int64_t clock_set_by_us = 0;  // forward by so much
  Duration stops_at{};               // the core's process is stopped from then on,
  Duration stops_for{};              // for so long; 0: not at all
};

/// Runs a pack by a script and returns its recording.
inline std::string recorded_run(const PackConfig& pack, std::string_view script, const RecordedRun& wanted) {
  auto scenario = parse_scenario(script, core_vocabulary());
  REQUIRE(scenario);
  VirtualRun run(pack.core, simulator_config(pack.core), *scenario);
  RecordWriter writer({.version = "0.1.0",
                       .buses = {.internal = "vcan0", .vehicle = "vcan0"},
                       .sources = pack.sources,
                       .hash = pack.core.hash});
  while (run.elapsed() < wanted.begin_after) run.step();
  writer.begin(run.core(), run.now(), wanted.from_us);
  run.set_tap(&writer);
  Duration part_began = wanted.begin_after;
  std::int64_t behind_us = 0;
  const auto wall_us = [&] {
    const auto since = run.elapsed() - wanted.begin_after;
    return wanted.from_us - behind_us + std::chrono::duration_cast<std::chrono::microseconds>(since).count();
  };
  while (run.elapsed() < wanted.length) {
    if (wanted.stops_for > Duration{} && run.elapsed() == wanted.stops_at) run.stop();
    run.step();
    if (wanted.stops_for > Duration{} && run.elapsed() == wanted.stops_at + wanted.stops_for) run.go_on();
    if (wanted.clock_set_by_us != 0 && run.elapsed() == wanted.clock_set_at) {
      behind_us -= wanted.clock_set_by_us;
      writer.set_wall_clock(run.now(), wall_us());
    }
    const bool is_over = run.elapsed() >= wanted.length;
    if (is_over || run.elapsed() - part_began < wanted.part_length) continue;
    part_began = run.elapsed();
    behind_us += wanted.clock_behind_us;
    writer.begin(run.core(), run.now(), wall_us(), true);
  }
  return writer.text();
}

/// The same with the demonstration pack.
inline std::string recorded_run(std::string_view script, const RecordedRun& wanted) {
  return recorded_run(demo_pack(), script, wanted);
}

/// The same of this length, as one part.
inline std::string recorded_run(std::string_view script, Duration length) {
  return recorded_run(script, RecordedRun{.length = length});
}

}  // namespace bmu::test
