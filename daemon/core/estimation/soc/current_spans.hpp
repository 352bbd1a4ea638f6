// What flowed between two looks at the pack's counter (coulomb_counter.hpp): the part that was counted, with its mean,
// and the part that was not, because the sensor said nothing. A filter takes them one after the other, so that a short
// silence costs neither the charge that was counted nor the doubt about what was not.
#pragma once

#include <cstdint>

#include "daemon/core/estimation/soc/coulomb_counter.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Seconds, and the mean current over them, out of the pack; 0 seconds: there is no such part.
struct CurrentSpans {
  double counted_s = 0.0;
  double mean_current_A = 0.0;
  double uncounted_s = 0.0;
};

class CurrentSpanMeter {
 public:
  /// `gap_max`: a sensor that is silent for longer is not counted over when it speaks again (ages/pack_current_ms).
  explicit CurrentSpanMeter(Duration gap_max = {}) : gap_max_(gap_max) {}
  /// What is counted begins now.
  void begin(TimePoint now, const ChargeState& charge) {
    until_ = end_of(now, charge);
    counted_ = charge.counted;
    flowed_uAs_ = charge.flowed_uAs;
  }
  /// Since the last call, or begin(). While the sensor speaks, time ends with its last sample, else now.
  [[nodiscard]] CurrentSpans next(TimePoint now, const ChargeState& charge) {
    constexpr double uAs_per_As = 1e6;
    const TimePoint until = end_of(now, charge);
    const double passed_s = to_s(until - until_);
    CurrentSpans spans{.counted_s = to_s(charge.counted - counted_)};
    if (spans.counted_s > 0.0) {
      spans.mean_current_A = static_cast<double>(charge.flowed_uAs - flowed_uAs_) / uAs_per_As / spans.counted_s;
    }
    spans.uncounted_s = passed_s - spans.counted_s > least_s ? passed_s - spans.counted_s : 0.0;
    begin(now, charge);
    return spans;
  }

 private:
  /// Less than this between two looks is no silence but the clock's grain.
  static constexpr double least_s = 1e-6;

  [[nodiscard]] TimePoint end_of(TimePoint now, const ChargeState& charge) const {
    return now - charge.counted_until > gap_max_ ? now : charge.counted_until;
  }

  Duration gap_max_{};
  TimePoint until_{};
  Duration counted_{};
  std::int64_t flowed_uAs_ = 0;
  BMU_FIELDS(skipped(gap_max_), until_, counted_, flowed_uAs_)
};

}  // namespace bmu
