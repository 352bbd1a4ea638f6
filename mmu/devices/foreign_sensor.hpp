// An emulated current sensor with frames of its own, in whatever protocol: the current of the moment, every so often.
#pragma once

#include <optional>

#include "devices/current_sensor.hpp"
#include "mmu/devices/current_sensor.hpp"
#include "mmu/devices/periodic.hpp"

namespace bmu {

class ForeignSensor {
 public:
  /// `driver` null: there is none. `counts_charging`: it is mounted so that a current into the pack is positive, as the
  /// pack file's `invert_current` has it.
  ForeignSensor(const CurrentSensorDriver* driver, TimePoint started_at, bool counts_charging = false)
      : driver_(driver),
        due_(started_at + period(), driver != nullptr ? period() : Duration{1}),
        counts_charging_(counts_charging) {}

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  [[nodiscard]] const CurrentSensorDriver* driver() const { return driver_; }
  /// What is due, if anything; of a stuck one the value that was told before.
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
