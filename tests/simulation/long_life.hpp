// Sixty days of one core with its module, sensor, PDU and cells, in minutes: tests for leaks, overflows and drift.
//
// A day has a drive of four minutes, a charge of six, and 23 h 50 min of standing. Each seventh night a cell is too
// low, and the pack goes to sleep. Time steps:
//
//   driving, charging, waking up, and two minutes around each wrap    devices, cells every 1 ms, core every 10 ms
//   parked and asleep                                                 all of it every 50 ms, cells 50 times slower
//
// A core that is called every 50 ms is like one on a busy machine: the longest period that is not reported as late.
// With `ticks_fully` it is called every 10 ms at night, too.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "protocol/time.hpp"

namespace bmu::test {

struct LongOptions {
  Duration length = 60 * 24h;
  TimePoint starts_at{1s};
  bool ticks_fully = false;
  std::function<void(Duration lived)> progress{};  // each hour
  /// Replaces the state of charge that the core publishes: whether an error is detected.
  std::function<std::int32_t(std::int32_t soc_permille, Duration lived)> told{};
};

struct LongResult {
  Duration lived{};
  Duration finely{};  // of that with 1 ms
  std::uint64_t ticks = 0;
  std::uint64_t frames = 0;
  std::uint64_t times_closed = 0;
  std::uint64_t times_asleep = 0;
  std::uint64_t allocations = 0;     // after the first hour
  std::int64_t memory_first_kB = 0;  // resident, after the first hour
  std::int64_t memory_last_kB = 0;
  std::vector<std::string> wrong;  // one line each
};

[[nodiscard]] LongResult live_long(const LongOptions& options);
[[nodiscard]] std::string to_text(const LongResult& result);

}  // namespace bmu::test
