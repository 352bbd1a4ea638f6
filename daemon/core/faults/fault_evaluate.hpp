// Comparing a reading with its row's thresholds. Pure; memory is fault_memory's business.
#pragma once

#include "daemon/core/faults/fault_table.hpp"

namespace bmu {

struct Thresholds {
  std::int64_t warn = 0;
  std::int64_t open = 1;
  std::int64_t hysteresis = 0;
  bool has_warning = false;
  Duration warn_confirm{};  // evidence that a warning takes; 0: the first sample beyond `warn` warns
  Duration confirm{};
  Duration clear{};
};

[[nodiscard]] Thresholds thresholds_of(const FaultRow& row, const LimitsConfig& limits);

enum class Verdict : std::uint8_t {
  good,     // behind the threshold by at least the hysteresis
  between,  // behind the threshold, but not far enough to call it good again
  beyond,   // at the threshold or past it
  unknown,  // no reading, or a good one that does not speak for everything: neither raises nor clears
};

/// A reading against one threshold. At the threshold counts as beyond. A partial reading can be beyond but never good:
/// the value that is missing may be the bad one.
[[nodiscard]] constexpr Verdict evaluate(const Reading& reading, Sense sense, std::int64_t threshold,
                                         std::int64_t hysteresis) {
  if (!reading.is_known) return Verdict::unknown;
  const std::int64_t past = sense == Sense::at_or_above ? reading.value - threshold : threshold - reading.value;
  if (past >= 0) return Verdict::beyond;
  if (reading.is_partial) return Verdict::unknown;
  return -past >= hysteresis ? Verdict::good : Verdict::between;
}

}  // namespace bmu
