// What the two files of readers share.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "daemon/core/faults/fault_readers.hpp"

namespace bmu::fault_readers {

inline constexpr Reading unknown_reading{};

[[nodiscard]] inline Reading condition(bool is_true, TimePoint seen_at, const Element& element = {}) {
  return {true, is_true ? 1 : 0, element, seen_at};
}

/// How far apart two voltages are that were not taken at the same moment, less what the current explains: twice what
/// this resistance makes of its swing since the older one. Cold cells have more than their data sheet says.
[[nodiscard]] inline std::int64_t unexplained_mV(const FaultInputs& in, const Measured<std::int32_t>& one,
                                                 const Measured<std::int32_t>& other, std::int64_t resistance_uOhm) {
  constexpr std::int64_t products_per_mV = 1'000'000;  // of mA and uOhm
  const std::int64_t swing_mA = in.sensors->current_window.swing_mA(std::min(one.taken_at, other.taken_at));
  const std::int64_t explained_mV = 2 * swing_mA * resistance_uOhm / products_per_mV;
  return std::max<std::int64_t>(std::llabs(std::int64_t{one.value} - other.value) - explained_mV, 0);
}

}  // namespace bmu::fault_readers
