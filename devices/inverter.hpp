// What every inverter is told of its battery and tells itself, whatever language it speaks, and what a device says of
// that language.
//
//   const InverterDriver& driver = *find_device("pylontech")->inverter;
//   for (index below driver.frame_count) if (const auto frame = driver.frame(index, report, options)) send(*frame);
//   const InverterWord word = driver.take(frame, said);                                       // each frame heard
//
// The frames are told round by round; the first `urgent_count` of them say what may flow, which is told again at once
// when it falls. What the form has no code for and nobody knows is not told: its frame is left out. `hear` and `words`
// look from the other side, for what is sent through a gate and for emulated inverters; a test holds each pair against
// each other.
//
// Pure; some 50 ns a frame.
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

/// What is wrong with a battery, in the words that these protocols have. The number is the bit in BatteryReport; the
/// order of all but the last is that of 35Ah.
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

/// Limits are rounded to the safe side by whoever tells them: a current and the highest voltage down, the lowest
/// voltage up.
struct BatteryReport {
  std::int32_t charge_voltage_limit_mV = 0;
  std::int32_t discharge_voltage_limit_mV = 0;
  std::int32_t charge_limit_mA = 0;  // 0: none may flow
  std::int32_t discharge_limit_mA = 0;
  bool may_charge = false;
  bool may_discharge = false;
  bool asks_for_charge = false;       // it is nearly empty: from wherever the current comes
  bool asks_for_full_charge = false;  // it has not been full for long
  SignalValue soc_permille;
  SignalValue soh_permille;
  SignalValue voltage_mV;
  SignalValue current_mA;  // positive out of the battery, whatever the wire has
  SignalValue temperature_dC;
  SignalValue cell_voltage_min_uV;
  SignalValue cell_voltage_max_uV;
  SignalValue cell_temperature_min_dC;
  SignalValue cell_temperature_max_dC;
  std::uint16_t alarms = 0;    // bits by BatteryAlarm: it has stopped, or is about to
  std::uint16_t warnings = 0;  // likewise: it goes on
  std::uint8_t module_count = 0;
  std::int64_t capacity_uAs = 0;
  std::array<char, 8> name{};  // zeros: `default_name` of the driver

  friend constexpr bool operator==(const BatteryReport&, const BatteryReport&) = default;
};

/// What those who build inverters and batteries do not agree on.
struct InverterOptions {
  bool is_discharge_positive = false;  // the sign of the battery's current in 356h
  bool has_short_frames = false;       // only the bytes that have a meaning; else eight

  friend constexpr bool operator==(const InverterOptions&, const InverterOptions&) = default;
};

/// What an inverter said last, each as it was told: not known until it was.
struct InverterReport {
  SignalValue voltage_mV;
  SignalValue current_mA;  // positive out of the battery
  SignalValue temperature_dC;
  bool has_failed = false;   // in its own words
  bool has_warning = false;  // likewise
  std::uint16_t error_number = 0;
  std::uint64_t values_out_of_range = 0;  // of all frames taken

  friend constexpr bool operator==(const InverterReport&, const InverterReport&) = default;
};

/// What a frame was, of those that an inverter sends.
enum class InverterWord : std::uint8_t {
  none,     // not an inverter's
  refused,  // under its identifier, and of a wrong length or form: nothing was taken from it
  alive,    // it shows that it is there
  other,
};

/// What a frame was, of those that a battery sends.
enum class BatteryWord : std::uint8_t {
  none,      // not a battery's in this language
  refused,   // under its identifier, and of a wrong length or form: nothing was taken from it
  limits,    // how much may flow
  requests,  // what is allowed and asked for
  other,
};

using InverterFrames = FixedVector<CanFrame, 2>;

/// Of one round.
inline constexpr std::size_t inverter_frames_max = 16;

struct InverterDriver {
  std::string_view name;  // of the device
  std::string_view default_name;
  std::uint8_t frame_count = 0;
  std::uint8_t urgent_count = 1;
  Duration period_min{};               // the limits are never told more often
  Duration battery_life{};             // of limits that are not told again
  Duration keep_alive_period{};        // of its own word
  bool is_discharge_positive = false;  // the sign that this form is known with: InverterOptions
  bool stops_at_alarm = false;         // it stops while an alarm of the battery is raised, whatever may flow

  /// Frame `index` of a round; nothing if what it is for is not known.
  std::optional<CanFrame> (*frame)(std::size_t index, const BatteryReport& report,
                                   const InverterOptions& options) = nullptr;
  /// Takes what a frame of the inverter says.
  InverterWord (*take)(const CanFrame& frame, InverterReport& report) = nullptr;

  /// The other way: limits and requests of a frame that a battery sends, if it is one.
  BatteryWord (*hear)(const CanFrame& frame, BatteryReport& report) = nullptr;
  /// And what an inverter says that has this to report.
  InverterFrames (*words)(const InverterReport& report) = nullptr;
};

}  // namespace bmu
