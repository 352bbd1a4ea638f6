// Helpers shared by the two files of fault readers.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "daemon/core/faults/fault_readers.hpp"

namespace bmu::fault_readers {

inline constexpr Reading unknown_reading{};

[[nodiscard]] inline Reading condition(bool is_true, TimePoint seen_at, const Element& element = {}) {
  return {true, is_true ? 1 : 0, element, seen_at};
}

/// Difference of two voltages of different instants, less the part that the current explains: twice the voltage drop
/// across this resistance caused by the swing of the current since the older sample. Twice, because cold cells have
/// more resistance than their data sheet states.
[[nodiscard]] inline std::int64_t unexplained_mV(const FaultInputs& in, const Measured<std::int32_t>& one,
                                                 const Measured<std::int32_t>& other, std::int64_t resistance_uOhm) {
  constexpr std::int64_t products_per_mV = 1'000'000;  // of mA and uOhm
  const std::int64_t swing_mA = in.sensors->current_window.swing_mA(std::min(one.taken_at, other.taken_at));
  const std::int64_t explained_mV = 2 * swing_mA * resistance_uOhm / products_per_mV;
  return std::max<std::int64_t>(std::llabs(std::int64_t{one.value} - other.value) - explained_mV, 0);
}

}  // namespace bmu::fault_readers
