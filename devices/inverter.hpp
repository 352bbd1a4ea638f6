// Data that an inverter receives about its battery and its own reports, independent of its protocol, and the driver
// that a device has for its protocol.
//
//   const InverterDriver& driver = *find_device("pylontech")->inverter;
//   for (index below driver.frame_count) if (const auto frame = driver.frame(index, report, options)) send(*frame);
//   const InverterWord word = driver.take(frame, reported);                                   // each received frame
//
// The frames are sent in rounds; the first `urgent_count` of them carry the limits, which are sent again at once when
// they fall. A frame with an unknown value is omitted if the protocol has no code for it. The last two functions of a
// driver are the inverse ones, for the output gate and for emulated inverters; a test checks each pair against each
// other.
//
// Pure; about 50 ns per frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Alarms of a battery that these protocols have. The number is the bit in BatteryReport; the order of all but the last
/// is that of 35Ah.
enum class BatteryAlarm : std::uint8_t {
  general,
  high_voltage,
  low_voltage,
  hot,
  cold,
  hot_to_charge,
  cold_to_charge,
  high_current,  // out of the battery
  high_charge_current,
  contactor,
  short_circuit,
  internal,
  imbalance,
  communication,
};
inline constexpr std::size_t battery_alarm_count = 14;

[[nodiscard]] constexpr std::uint16_t bit_of(BatteryAlarm alarm) {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(alarm));
}

/// Report of a battery. Its sender rounds limits to the safe side: a current and the charge voltage limit down, the
/// discharge voltage limit up.
struct BatteryReport {
  std::int32_t charge_voltage_limit_mV = 0;
  std::int32_t discharge_voltage_limit_mV = 0;
  std::int32_t charge_limit_mA = 0;  // 0: no current allowed
  std::int32_t discharge_limit_mA = 0;
  bool may_charge = false;
  bool may_discharge = false;
  bool asks_for_charge = false;       // nearly empty: requests charging from any source
  bool asks_for_full_charge = false;  // has not been full for a long time
  SignalValue soc_permille;
  SignalValue soh_permille;
  SignalValue voltage_mV;
  SignalValue current_mA;  // positive out of the battery, regardless of the sign on the wire
  SignalValue temperature_dC;
  SignalValue cell_voltage_min_uV;
  SignalValue cell_voltage_max_uV;
  SignalValue cell_temperature_min_dC;
  SignalValue cell_temperature_max_dC;
  std::uint16_t alarms = 0;    // bits by BatteryAlarm: the battery has stopped, or is about to
  std::uint16_t warnings = 0;  // likewise: operation continues
  std::uint8_t module_count = 0;
  std::int64_t capacity_uAs = 0;
  std::array<char, 8> name{};  // zeros: `default_name` of the driver

  friend constexpr bool operator==(const BatteryReport&, const BatteryReport&) = default;
};

/// Settings in which inverters and batteries differ.
struct InverterOptions {
  bool is_discharge_positive = false;  // the sign of the battery's current in 356h
  bool has_short_frames = false;       // only the bytes that have a meaning; otherwise eight

  friend constexpr bool operator==(const InverterOptions&, const InverterOptions&) = default;
};

/// Last report of an inverter; each value is unknown until it is reported.
struct InverterReport {
  SignalValue voltage_mV;
  SignalValue current_mA;  // positive out of the battery
  SignalValue temperature_dC;
  bool has_failed = false;   // as reported by the inverter
  bool has_warning = false;  // likewise
  std::uint16_t error_number = 0;
  std::uint64_t values_out_of_range = 0;  // of all frames read

  friend constexpr bool operator==(const InverterReport&, const InverterReport&) = default;
};

/// Type of a frame with respect to those that an inverter sends.
enum class InverterWord : std::uint8_t {
  none,     // not from an inverter
  refused,  // its identifier with a wrong length or frame type: nothing was read from it
  alive,    // shows that the inverter is present
  other,
};

/// Type of a frame with respect to those that a battery sends.
enum class BatteryWord : std::uint8_t {
  none,      // not from a battery with this protocol
  refused,   // its identifier with a wrong length or frame type: nothing was read from it
  limits,    // limits of voltage and current
  requests,  // permissions and requests
  other,
};

using InverterFrames = FixedVector<CanFrame, 2>;

/// Limit for the frames of one round.
inline constexpr std::size_t inverter_frames_max = 16;

struct InverterDriver {
  std::string_view name;  // of the device
  std::string_view default_name;
  std::uint8_t frame_count = 0;
  std::uint8_t urgent_count = 1;
  Duration period_min{};               // the limits are never sent more often
  Duration battery_life{};             // timeout of limits that are not sent again
  Duration keep_alive_period{};        // of the inverter's own message
  bool is_discharge_positive = false;  // usual sign in this protocol: InverterOptions
  bool stops_at_alarm = false;         // stops while an alarm of the battery is raised, regardless of the limits

  /// Frame `index` of a round; none if its values are unknown.
  std::optional<CanFrame> (*frame)(std::size_t index, const BatteryReport& report,
                                   const InverterOptions& options) = nullptr;
  /// Reads a frame of the inverter.
  InverterWord (*take)(const CanFrame& frame, InverterReport& report) = nullptr;

  /// Inverse of `frame`: limits and requests of a frame that a battery sends, if it is one.
  BatteryWord (*hear)(const CanFrame& frame, BatteryReport& report) = nullptr;
  /// Inverse of `take`: the frames of an inverter with this report.
  InverterFrames (*words)(const InverterReport& report) = nullptr;
};

}  // namespace bmu
