// Reading and writing of the settings of a sensor with configurable results, and the driver that a device has for it.
//
//   const SensorSetUpDriver& driver = *find_device("ivt_s")->set_up;
//   send(driver.command({.kind = SetUpOrderKind::read, .channel = 1}));
//   const SetUpAnswer answer = driver.take(frame);   // each received frame
//
// An order is one command, an answer one frame. Neither is protected by a counter or a checksum, and a command that is
// not allowed is answered as well: only settings that are read afterwards are certain. `order_of` and `answer` are the
// inverse functions, for the output gate and for emulated sensors. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class SensorTrigger : std::uint8_t { off, on_trigger, cyclic };

/// Transmission settings of one result.
struct SensorSetting {
  SensorTrigger trigger = SensorTrigger::off;
  bool is_little_endian = false;
  bool is_inverted = false;  // sign of the result
  std::int32_t period_ms = 0;

  friend constexpr bool operator==(const SensorSetting&, const SensorSetting&) = default;
};

enum class SetUpOrderKind : std::uint8_t {
  read,   // the setting of a channel
  set,    // the same; takes effect only while stopped
  stop,   // no results from now on
  run,    // results from now on, and after each start
  store,  // settings persist when the sensor's supply is switched off
};
struct SetUpOrder {
  SetUpOrderKind kind = SetUpOrderKind::read;
  std::uint8_t channel = 0;  // of `read` and `set`
  SensorSetting setting;     // of `set`

  friend constexpr bool operator==(const SetUpOrder&, const SetUpOrder&) = default;
};

enum class SetUpWord : std::uint8_t {
  none,     // not an answer of this sensor
  refused,  // its identifier with a wrong length or frame type, or an invalid setting
  setting,  // of a channel: it was read, or set
  stopped,
  running,
  stored,
  alive,           // the sensor has just started
  not_understood,  // the sensor does not support the command
  other,           // an answer to another command
};
struct SetUpAnswer {
  SetUpWord word = SetUpWord::none;
  std::uint8_t channel = 0;
  SensorSetting setting;

  friend constexpr bool operator==(const SetUpAnswer&, const SetUpAnswer&) = default;
};

/// Number of channels of a sensor; each channel is one result.
inline constexpr std::uint8_t sensor_channels_max = 8;

struct SensorSetUpDriver {
  std::string_view name;          // of the device
  std::uint32_t command_id = 0;   // of 11 bits, as delivered; any other node that sends it commands the sensor
  std::uint32_t response_id = 0;  // likewise, of its answers
  Duration command_pause{};       // between two commands
  Duration response_time_max{};
  CanFrame (*command)(const SetUpOrder& order) = nullptr;
  SetUpAnswer (*take)(const CanFrame& frame) = nullptr;
  std::optional<SetUpOrder> (*order_of)(const CanFrame& frame) = nullptr;
  CanFrame (*answer)(const SetUpAnswer& answer) = nullptr;
};

}  // namespace bmu
