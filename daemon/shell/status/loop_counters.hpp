// How well the control loop keeps its time.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/types/observation.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct LoopCounters {
  std::uint64_t ticks_late = 0;  // decided more than a tick's period after they were due
  Duration latest{};             // the worst of all
  std::uint64_t wake_ups = 0;
  /// What was heard and seen back so far, as bits on the wire: of each port, and of a shared bus with the internal one.
  std::array<std::uint64_t, port_count> bits_seen{};
};

}  // namespace bmu
