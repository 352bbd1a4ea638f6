// Processor time of the calling thread: measures effort, whatever else runs on the machine.
#pragma once

#include <ctime>

#include "tests/support/catch.hpp"

namespace bmu::test {

/// In seconds, from an arbitrary point in time on.
[[nodiscard]] inline double processor_time_s() {
  timespec time{};
  REQUIRE(::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time) == 0);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

}  // namespace bmu::test
