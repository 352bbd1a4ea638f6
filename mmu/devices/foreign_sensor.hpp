// Emulated current sensor with frames of its own, in any protocol: the present current, periodically.
#pragma once

#include <optional>

#include "devices/current_sensor.hpp"
#include "mmu/devices/current_sensor.hpp"
#include "mmu/devices/periodic.hpp"

namespace bmu {

class ForeignSensor {
 public:
  /// `driver` null: no sensor. `counts_charging`: it is mounted so that a current into the pack is positive, as for the
  /// pack file's `invert_current`.
  ForeignSensor(const CurrentSensorDriver* driver, TimePoint started_at, bool counts_charging = false)
      : driver_(driver),
        due_(started_at + period(), driver != nullptr ? period() : Duration{1}),
        counts_charging_(counts_charging) {}

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  [[nodiscard]] const CurrentSensorDriver* driver() const { return driver_; }
  /// The frame that is due, if any; a stuck sensor repeats its last value.
  [[nodiscard]] std::optional<CanFrame> tick(TimePoint now, const SensorMeasurements& measured, bool is_stuck) {
    if (!is_there() || !due_.take(now)) return std::nullopt;
    if (!is_stuck) told_mA_ = counts_charging_ ? -measured.current_mA : measured.current_mA;
    return driver_->report(measured.has_error[0] ? not_known(Validity::sensor_fault) : known(told_mA_));
  }

 private:
  [[nodiscard]] Duration period() const { return driver_ != nullptr ? driver_->period : Duration{}; }

  const CurrentSensorDriver* driver_;
  Periodic due_;
  bool counts_charging_;
  std::int32_t told_mA_ = 0;
};

}  // namespace bmu
