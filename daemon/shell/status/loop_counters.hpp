// Timing of the control loop.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/types/observation.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct LoopCounters {
  std::uint64_t ticks_late = 0;  // decided more than a tick period after they were due
  Duration latest{};             // maximum delay of a tick
  std::uint64_t wake_ups = 0;
  /// Bits on the wire received and echoed so far, of each port; a shared bus counts at the port that serves it.
  std::array<std::uint64_t, port_count> bits_seen{};
};

}  // namespace bmu
