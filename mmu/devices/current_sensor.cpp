#include "mmu/devices/current_sensor.hpp"

#include <algorithm>

namespace bmu {

namespace {

// A count is 1 mV * 1 mA * 1 ms, a billionth of a joule; 1 mWh is 3.6 J.
constexpr std::int64_t counts_per_mWh = 3'600'000'000;

struct ChannelRows {
  const MessageSpec* big_endian;
  const MessageSpec* little_endian;
};
constexpr std::array<ChannelRows, sensor_channel_count> channel_rows{{
    {&internal_bus::sensor_current, &internal_bus::sensor_current_le},
    {&internal_bus::sensor_u1, &internal_bus::sensor_u1_le},
    {&internal_bus::sensor_u2, &internal_bus::sensor_u2_le},
    {&internal_bus::sensor_charge, &internal_bus::sensor_charge_le},
    {&internal_bus::sensor_energy, &internal_bus::sensor_energy_le},
}};
constexpr ChannelRows second_current_rows{&internal_bus::sensor_current_2, &internal_bus::sensor_current_2_le};

// Every result row has its signals at the same positions.
constexpr std::size_t value_signal = 0;
constexpr std::size_t system_error_signal = signal_index(internal_bus::sensor_current, "system_error");
constexpr std::size_t any_error_signal = signal_index(internal_bus::sensor_current, "any_measurement_error");
constexpr std::size_t error_signal = signal_index(internal_bus::sensor_current, "measurement_error");
constexpr std::size_t overcurrent_signal = signal_index(internal_bus::sensor_current, "overcurrent");

Periodic periodic_from(TimePoint powered_at, Duration period) {
  return {powered_at + period, std::max(period, Duration{1})};
}

}  // namespace

CurrentSensor::CurrentSensor(const CurrentSensorConfig& config, TimePoint powered_at, SensorPlace place)
    : config_(config),
      place_(place),
      accumulated_at_(powered_at),
      due_{periodic_from(powered_at, config.periods[0]), periodic_from(powered_at, config.periods[1]),
           periodic_from(powered_at, config.periods[2]), periodic_from(powered_at, config.periods[3]),
           periodic_from(powered_at, config.periods[4])} {
  is_little_endian_.fill(config.little_endian);
}

void CurrentSensor::configure(SensorChannel channel, bool is_little_endian, bool is_inverted, Duration period,
                              TimePoint now) {
  const auto index = static_cast<std::size_t>(channel);
  is_little_endian_[index] = is_little_endian;
  is_inverted_[index] = is_inverted;
  if (config_.periods[index] != period) due_[index] = periodic_from(now, period);
  config_.periods[index] = period;
}

bool CurrentSensor::is_faster_than(Duration step) const {
  return std::any_of(config_.periods.begin(), config_.periods.end(),
                     [step](Duration period) { return period > Duration{} && period < step; });
}

SensorFrames CurrentSensor::tick(TimePoint now, const SensorMeasurements& measured) {
  accumulate(now, measured);
  SensorFrames out;
  for (std::size_t index = 0; index < sensor_channel_count; ++index) {
    const auto channel = static_cast<SensorChannel>(index);
    if (is_sent(channel) && due_[index].take(now)) out.push_back(make_result(channel, measured));
  }
  return out;
}

bool CurrentSensor::is_sent(SensorChannel channel) const {
  const bool is_switched_on = config_.periods[static_cast<std::size_t>(channel)] > Duration::zero();
  return is_switched_on && (place_ == SensorPlace::first || channel == SensorChannel::current);
}

const MessageSpec& CurrentSensor::row_of(SensorChannel channel) const {
  const ChannelRows& rows =
      place_ == SensorPlace::first ? channel_rows[static_cast<std::size_t>(channel)] : second_current_rows;
  return is_little_endian_[static_cast<std::size_t>(channel)] ? *rows.little_endian : *rows.big_endian;
}

void CurrentSensor::accumulate(TimePoint now, const SensorMeasurements& measured) {
  const std::int64_t signed_mA = config_.invert_current ? -measured.current_mA : measured.current_mA;
  const std::int64_t passed_ms = to_ms(now - accumulated_at_);
  accumulated_at_ += std::chrono::milliseconds(passed_ms);
  charge_uAs_ += signed_mA * passed_ms;
  energy_counts_ += signed_mA * measured.pack_mV * passed_ms;
  current_sum_mA_ += signed_mA;
  ++current_samples_;
}

std::int64_t CurrentSensor::value_of(SensorChannel channel, const SensorMeasurements& measured) {
  switch (channel) {
    case SensorChannel::current: {
      const std::int64_t mean_mA = divide_to_nearest(current_sum_mA_, current_samples_);
      current_sum_mA_ = 0;
      current_samples_ = 0;
      return mean_mA;
    }
    case SensorChannel::pack_voltage: return measured.pack_mV;
    case SensorChannel::link_voltage: return measured.link_mV;
    case SensorChannel::charge: return charge_uAs_;
    case SensorChannel::energy: return divide_to_nearest(energy_counts_, counts_per_mWh);
  }
  return 0;
}

CanFrame CurrentSensor::make_result(SensorChannel channel, const SensorMeasurements& measured) {
  const auto index = static_cast<std::size_t>(channel);
  const MessageSpec& row = row_of(channel);
  const bool any_error =
      std::find(measured.has_error.begin(), measured.has_error.end(), true) != measured.has_error.end();
  CanFrame frame = make_frame(row);
  const std::int64_t value = value_of(channel, measured);
  encode_signal(row.signals[value_signal], known(is_inverted_[index] ? -value : value), frame.data);
  encode_signal(row.signals[system_error_signal], known(measured.has_system_error), frame.data);
  encode_signal(row.signals[any_error_signal], known(any_error), frame.data);
  encode_signal(row.signals[error_signal], known(measured.has_error[index]), frame.data);
  encode_signal(row.signals[overcurrent_signal], known(measured.has_overcurrent), frame.data);
  seal(row, counters_[index]++, frame);
  return frame;
}

}  // namespace bmu
