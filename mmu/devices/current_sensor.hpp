// The current and voltage sensor (IVT-S): result frames of six bytes, each channel with its own period and its own
// 4-bit counter, no checksum.
//
//   tick(now, measurements)   every 1 ms or so; returns the results that are due. Current is the mean since the last
//                             result, as the sensor's integrating converter gives it; voltages are momentary.
//
// A second sensor is another device of this kind that measures the same current and sends only that, at an identifier
// of its own.
//
// Charge and energy counters count from power-up and are sent only if a period is set, as in a sensor as delivered.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "mmu/devices/periodic.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

enum class SensorChannel : std::uint8_t { current, pack_voltage, link_voltage, charge, energy };
inline constexpr std::size_t sensor_channel_count = 5;
inline constexpr std::array<std::string_view, sensor_channel_count> sensor_channel_names{
    "current", "pack_voltage", "link_voltage", "charge", "energy"};

/// Number of a result in the commands that configure the sensor.
[[nodiscard]] constexpr std::size_t set_up_channel(SensorChannel channel) {
  constexpr std::array<std::size_t, sensor_channel_count> channels{0, 1, 2, 6, 7};
  return channels[static_cast<std::size_t>(channel)];
}

enum class SensorPlace : std::uint8_t { first, second };

struct CurrentSensorConfig {
  bool little_endian = false;
  bool invert_current = false;  // count charging as positive
  bool has_second = false;      // a second sensor; byte order, sign and period of the current as the first
  // 0: this result is switched off.
  std::array<Duration, sensor_channel_count> periods{20ms, 60ms, 60ms, 0ms, 0ms};
};

struct SensorMeasurements {
  std::int32_t current_mA = 0;  // positive leaves the pack
  std::int32_t pack_mV = 0;
  std::int32_t link_mV = 0;
  std::array<bool, sensor_channel_count> has_error{};  // this result is out of range or unreliable
  bool has_system_error = false;
  bool has_overcurrent = false;
};

using SensorFrames = FixedVector<CanFrame, sensor_channel_count>;

class CurrentSensor {
 public:
  CurrentSensor(const CurrentSensorConfig& config, TimePoint powered_at, SensorPlace place = SensorPlace::first);

  /// Sets byte order, sign and period (0: not sent) of a result from now on.
  void configure(SensorChannel channel, bool is_little_endian, bool is_inverted, Duration period, TimePoint now);
  /// Whether a result has a period shorter than `step`.
  [[nodiscard]] bool is_faster_than(Duration step) const;
  [[nodiscard]] SensorFrames tick(TimePoint now, const SensorMeasurements& measured);

 private:
  [[nodiscard]] bool is_sent(SensorChannel channel) const;
  [[nodiscard]] const MessageSpec& row_of(SensorChannel channel) const;
  void accumulate(TimePoint now, const SensorMeasurements& measured);
  [[nodiscard]] std::int64_t value_of(SensorChannel channel, const SensorMeasurements& measured);
  [[nodiscard]] CanFrame make_result(SensorChannel channel, const SensorMeasurements& measured);

  CurrentSensorConfig config_;
  SensorPlace place_;
  TimePoint accumulated_at_;
  std::array<Periodic, sensor_channel_count> due_;
  std::array<bool, sensor_channel_count> is_little_endian_{};
  std::array<bool, sensor_channel_count> is_inverted_{};
  std::array<std::uint8_t, sensor_channel_count> counters_{};
  std::int64_t charge_uAs_ = 0;
  std::int64_t energy_counts_ = 0;  // of 1 mV * 1 mA * 1 ms: a billionth of a joule
  std::int64_t current_sum_mA_ = 0;
  std::int64_t current_samples_ = 0;
};

}  // namespace bmu
