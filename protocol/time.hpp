// Time as the pure parts know it: a point on some monotonic clock, handed in from outside.
//
// There is deliberately no now(): protocol, mmu and daemon/core are told the time with every observation, so a
// recording replayed later, or a simulation of hours, decides exactly what the daemon decided.
#pragma once

#include <chrono>
#include <cstdint>

namespace bmu {

struct MonotonicClock {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<MonotonicClock>;
  static constexpr bool is_steady = true;
};

using Duration = MonotonicClock::duration;
using TimePoint = MonotonicClock::time_point;

using namespace std::chrono_literals;

/// Whole milliseconds of a duration, rounded towards zero; for text, JSON and wire rows only.
[[nodiscard]] constexpr std::int64_t to_ms(Duration duration) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

/// Seconds since the clock's epoch, for text and JSON only.
[[nodiscard]] constexpr double to_s(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace bmu
