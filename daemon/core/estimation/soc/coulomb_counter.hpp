// Counter of the charge and energy that flowed out of the pack and into it, from the samples of the current sensor.
//
// The sums are exact integers, so that a month of counting drifts only as far as the sensor does. A gap in the current
// longer than the sensor's age limit is not bridged by a guess; it is counted as uncounted time. The estimators
// (pack_estimate.hpp) derive the state of charge.
#pragma once

#include <cstdint>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct ChargeState {
  std::int64_t flowed_uAs = 0;     // out of the pack since the first sample
  std::int64_t out_uAs = 0;        // charge that left the pack, 0 or more
  std::int64_t in_uAs = 0;         // charge that entered it, 0 or more; out less in is flowed, but for a rounded uAs
  std::int64_t energy_in_mWh = 0;  // since start
  std::int64_t energy_out_mWh = 0;
  Duration uncounted{};       // time without a usable current since the first sample
  Duration counted{};         // all time over which flowed_uAs was counted
  TimePoint counted_until{};  // the last sample of the current, whether it was usable or not
};

class CoulombCounter {
 public:
  void init(const CoreConfig& config);

  /// Adds a current sample as it arrives, with the pack voltage known at that time (unknown: energy is not counted).
  void observe(const Measured<std::int32_t>& current_mA, const Measured<std::int32_t>& pack_voltage_mV);

  [[nodiscard]] const ChargeState& state() const { return state_; }

 private:
  void count(std::int64_t mean_mA, Duration span);
  void count_energy(std::int64_t mean_mA, std::int64_t voltage_mV, Duration span);

  Duration gap_max_{};
  ChargeState state_;
  Measured<std::int32_t> last_mA_;
  std::int64_t charge_rest_ = 0;     // mA * ns, not yet a whole uAs
  std::int64_t out_rest_ = 0;        //
  std::int64_t in_rest_ = 0;         //
  std::int64_t energy_in_rest_ = 0;  // mV * mA * us, not yet a whole mWh
  std::int64_t energy_out_rest_ = 0;
  BMU_FIELDS(skipped(gap_max_), state_, last_mA_, charge_rest_, out_rest_, in_rest_, energy_in_rest_, energy_out_rest_)
};

}  // namespace bmu
