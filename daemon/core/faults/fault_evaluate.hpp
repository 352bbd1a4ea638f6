// Comparison of a reading with the thresholds of its row. Pure; FaultMemory keeps the state of each fault.
#pragma once

#include "daemon/core/faults/fault_table.hpp"

namespace bmu {

struct Thresholds {
  std::int64_t warn = 0;
  std::int64_t open = 1;
  std::int64_t hysteresis = 0;
  bool has_warning = false;
  Duration warn_confirm{};  // debounce time of a warning; 0: the first sample beyond `warn` raises it
  Duration confirm{};
  Duration clear{};
};

[[nodiscard]] Thresholds thresholds_of(const FaultRow& row, const LimitsConfig& limits);

enum class Verdict : std::uint8_t {
  good,     // inside the threshold by at least the hysteresis
  between,  // inside the threshold, within the hysteresis
  beyond,   // at or beyond the threshold
  unknown,  // no reading, or a partial one that is not beyond: neither raises nor clears
};

/// Compares a reading with one threshold. A value at the threshold is beyond. A partial reading can be beyond but never
/// good: the missing value may be the one that is beyond.
[[nodiscard]] constexpr Verdict evaluate(const Reading& reading, Sense sense, std::int64_t threshold,
                                         std::int64_t hysteresis) {
  if (!reading.is_known) return Verdict::unknown;
  const std::int64_t past = sense == Sense::at_or_above ? reading.value - threshold : threshold - reading.value;
  if (past >= 0) return Verdict::beyond;
  if (reading.is_partial) return Verdict::unknown;
  return -past >= hysteresis ? Verdict::good : Verdict::between;
}

}  // namespace bmu
