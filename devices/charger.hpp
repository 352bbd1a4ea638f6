// Commands and reports of a charger, independent of its protocol, and the driver that a device has for its protocol.
//
//   const ChargerDriver& driver = *find_device("elcon_tc")->charger;
//   // every command_period
//   send(driver.command(unit, {.is_enabled = true, .voltage_mV = 400'000, .current_mA = 8'000}));
//   // for each received frame
//   const ChargerNews news = driver.take(frame, reports);
//
// An order gives the maximum output of a unit, which stops by itself after `command_life` without one. The two inverse
// functions, `order_of` and `reports`, are for the output gate and for emulated chargers; a test checks each pair
// against each other. `commanded_unit` detects a second master: it evaluates the identifier alone.
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

/// Source address of a master's commands, in a protocol that has more than one.
enum class MasterAddress : std::uint8_t { f4, f5 };

/// Command to one unit.
struct ChargerOrder {
  MasterAddress master_address = MasterAddress::f4;  // of the sender; F4 if the protocol has no such address
  bool is_enabled = false;
  std::int32_t voltage_mV = 0;  // >= 0; sent in the protocol's steps, rounded down
  std::int32_t current_mA = 0;  // into the pack; likewise
  std::int32_t mains_current_mA = 0;
  bool clears_errors = false;   // if the protocol has it
  bool requests_mains = false;  // from a charging post, if the protocol has it

  friend constexpr bool operator==(const ChargerOrder&, const ChargerOrder&) = default;
};

/// Upper bound of the output that a charger reports, in tenths of a volt or an ampere: chosen by this program, as no
/// source gives one. No pack file may exceed it.
inline constexpr std::int64_t charger_output_raw_max = 15'000;

/// Reason that a charger reports for giving no output, or less. The number is the bit in ChargerReport::troubles.
enum class ChargerTrouble : std::uint8_t {
  hardware,
  too_hot,
  mains,               // voltage wrong, or no mains
  battery,             // reversed, or its voltage wrong
  no_command,          // the charger receives no command
  command_refused,     // a commanded value is out of its range
  output_overvoltage,  // above the permitted output
  unnamed,             // an error that is reported without its cause, or before the cause is reported
  no_battery,          // not connected or not started, or its voltage low
  no_mains,            // mains voltage low
};
inline constexpr std::size_t charger_trouble_count = 10;

[[nodiscard]] std::string_view to_text(ChargerTrouble trouble);

[[nodiscard]] constexpr std::uint16_t bit_of(ChargerTrouble trouble) {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(trouble));
}
template <class... Troubles>
[[nodiscard]] constexpr std::uint16_t bits_of_troubles(Troubles... troubles) {
  return static_cast<std::uint16_t>((0U | ... | bit_of(troubles)));
}

/// Those of `bits` that count as a trouble. While no charging is requested, a charger may be without a battery because
/// the contactors are open, without mains at a charging post, and without commands of a sleeping daemon.
[[nodiscard]] std::uint16_t troubles_among(std::uint16_t bits, bool is_asked);

/// Last report of a unit; each value is unknown until it is reported.
struct ChargerReport {
  SignalValue voltage_mV;  // at its output
  SignalValue current_mA;  // into the pack
  SignalValue mains_voltage_mV;
  SignalValue mains_current_mA;
  SignalValue temperature_dC;
  std::uint16_t troubles = 0;

  friend constexpr bool operator==(const ChargerReport&, const ChargerReport&) = default;
};

/// Type of a frame with respect to a charger's reports.
enum class ChargerWord : std::uint8_t {
  none,      // not from a charger
  refused,   // a charger's identifier with a wrong length or frame type: nothing was read from it
  values,    // voltage and current
  troubles,  // in a protocol with separate frames for them
  other,
};
struct ChargerNews {
  ChargerWord word = ChargerWord::none;
  std::uint8_t unit = 0;
};

struct ChargerCommand {
  std::uint8_t unit = 0;
  ChargerOrder order;
};

/// The frames of one report.
using ChargerFrames = FixedVector<CanFrame, 5>;

inline constexpr std::size_t charger_units_max = 4;

struct ChargerDriver {
  std::string_view name;  // of the device
  std::uint8_t unit_count_max = 1;
  Duration command_period{};
  Duration command_life{};      // without a command for this long it stops by itself
  Duration report_period{};     // of voltage and current
  Duration slow_period{};       // of troubles and temperatures, if these have separate frames; otherwise zero
  std::uint8_t fast_count = 0;  // with a slow period: number of frames of `reports` sent in each report period
  Duration settle{};            // maximum time to follow a command
  bool is_told_mains_current = false;
  bool can_request_mains = false;
  bool has_master_address = false;
  std::int32_t voltage_max_mV = 0;  // maximum that a command can carry
  std::int32_t current_max_mA = 0;
  // Behaviour of an emulated charger with its troubles; bits by ChargerTrouble.
  std::uint16_t reported_troubles = 0;  // those that its reports can indicate
  std::uint16_t stopping_troubles = 0;  // of these: no output with them; the others are warnings
  std::uint16_t latched_troubles = 0;   // of those: stay after their cause is gone, until a command clears them
  std::uint16_t supply_troubles = 0;    // of those: cleared by no command, only by switching its supply off

  CanFrame (*command)(std::uint8_t unit, const ChargerOrder& order) = nullptr;
  /// Reads a frame into the report of its unit in `reports`.
  ChargerNews (*take)(const CanFrame& frame, std::array<ChargerReport, charger_units_max>& reports) = nullptr;

  /// Unit that the identifier commands, regardless of the rest of the frame: the reaction of a charger to a frame of
  /// another length is unknown. A remote frame commands no unit.
  std::optional<std::uint8_t> (*commanded_unit)(const CanFrame& frame) = nullptr;
  /// Inverse of `command`: the content of a command, if the frame is complete.
  std::optional<ChargerCommand> (*order_of)(const CanFrame& frame) = nullptr;
  /// Inverse of `take`: the frames of a unit with this report.
  ChargerFrames (*reports)(std::uint8_t unit, const ChargerReport& report) = nullptr;
};

}  // namespace bmu
