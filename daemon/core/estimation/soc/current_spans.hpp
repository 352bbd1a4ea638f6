// Charge between two readings of the pack's counter (coulomb_counter.hpp): the counted part, with its mean current, and
// the part that was not counted because the sensor was silent. A filter processes them one after the other, so that a
// short silence loses neither the counted charge nor the uncertainty of the other part.
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
  /// `gap_max`: a longer silence of the sensor is not counted afterwards (ages/pack_current_ms).
  explicit CurrentSpanMeter(Duration gap_max = {}) : gap_max_(gap_max) {}
  /// Starts the interval now.
  void begin(TimePoint now, const ChargeState& charge) {
    until_ = end_of(now, charge);
    counted_ = charge.counted;
    flowed_uAs_ = charge.flowed_uAs;
  }
  /// Interval since the last call, or begin(). While the sensor sends, it ends with the last sample, else now.
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
  /// A shorter difference between two readings is no silence but the resolution of the clock.
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
