// Configurable part of the emulated current sensor, in any protocol: its settings, those it has stored, and its
// answers.
//
//   observe(frame, now)   a command is answered `answer_after` later; a setting takes effect only while it is stopped,
//                         and is acknowledged in any case
//   restart(now)          it is silent for `restart_takes`, then sends alive, and continues with the stored settings
//
// The start time of a real sensor is unknown.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "devices/sensor_set_up.hpp"

namespace bmu {

class SensorUnit {
 public:
  static constexpr Duration answer_after = 3ms;
  static constexpr Duration restart_takes = 100ms;
  using Settings = std::array<SensorSetting, sensor_channels_max>;

  /// `driver` null: it cannot be configured. As delivered: the settings are also the stored ones.
  SensorUnit(const SensorSetUpDriver* driver, const Settings& settings)
      : SensorUnit(driver, settings, driver != nullptr ? driver->command_id : 0,
                   driver != nullptr ? driver->response_id : 0) {}
  /// A sensor with other identifiers for command and answer.
  SensorUnit(const SensorSetUpDriver* driver, const Settings& settings, std::uint32_t command_id,
             std::uint32_t response_id)
      : driver_(driver), command_id_(command_id), response_id_(response_id), settings_(settings), stored_(settings) {}

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  [[nodiscard]] const SensorSetUpDriver* driver() const { return driver_; }
  void observe(const CanFrame& frame, TimePoint now);
  /// The frame that is due, if any.
  [[nodiscard]] std::optional<CanFrame> tick(TimePoint now);
  [[nodiscard]] bool is_answering() const { return waiting_.has_value(); }
  /// Whether it sends results.
  [[nodiscard]] bool is_running() const { return is_running_ && starts_at_ == TimePoint{}; }
  [[nodiscard]] const SensorSetting& setting(std::size_t channel) const { return settings_.at(channel); }
  [[nodiscard]] const Settings& stored() const { return stored_; }

  void restart(TimePoint now);
  /// Sets and stores the setting of a result, as another tool would.
  void give(std::size_t channel, const SensorSetting& setting) {
    settings_.at(channel) = stored_.at(channel) = setting;
  }
  bool answers = true;

 private:
  [[nodiscard]] SetUpAnswer obey(const SetUpOrder& order);
  [[nodiscard]] CanFrame answer_of(const SetUpAnswer& answer) const;

  const SensorSetUpDriver* driver_;
  std::uint32_t command_id_;
  std::uint32_t response_id_;
  Settings settings_;
  Settings stored_;
  bool is_running_ = true;
  TimePoint starts_at_{};            // zero: it has started
  std::optional<CanFrame> waiting_;  // to be sent; replaced if the next one is ready before
  TimePoint answers_at_{};
};

}  // namespace bmu
