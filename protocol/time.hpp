// Time in the pure parts: a point on some monotonic clock, passed in from outside.
//
// There is deliberately no now(): protocol, mmu and daemon/core receive the time with every observation, so a recording
// replayed later, or a simulation of hours, gives exactly the decisions of the daemon.
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

/// Whole milliseconds of a duration, rounded towards zero; for text, JSON, wire rows and integer arithmetic.
[[nodiscard]] constexpr std::int64_t to_ms(Duration duration) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

/// Seconds of a duration; for text, JSON and estimators.
[[nodiscard]] constexpr double to_s(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace bmu
