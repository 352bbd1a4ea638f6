// What every charger is told and tells, whatever language it speaks, and what a device says of that language.
//
//   const ChargerDriver& driver = *find_device("elcon_tc")->charger;
//   send(driver.command(unit, {.is_enabled = true, .voltage_mV = 400'000, .current_mA = 8'000}));   // every
//   command_period const ChargerNews news = driver.take(frame, reports[unit]);                                     //
//   each frame heard
//
// An order says the most a unit may give; it stops by itself after `command_life` without one. The two functions that
// look from the other side, `order_of` and `reports`, are for what is sent through a gate and for emulated chargers; a
// test holds each pair against each other. `commanded_unit` finds a second master: it goes by the identifier alone.
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

/// The source address of a master's commands, in a protocol that knows more than one.
enum class MasterAddress : std::uint8_t { f4, f5 };

/// Of one unit.
struct ChargerOrder {
  MasterAddress master_address = MasterAddress::f4;  // of the sender; F4 where the protocol has no such address
  bool is_enabled = false;
  std::int32_t voltage_mV = 0;  // 0 and more; told in the protocol's steps, rounded down
  std::int32_t current_mA = 0;  // into the pack; likewise
  std::int32_t mains_current_mA = 0;
  bool clears_errors = false;   // where it can be told
  bool requests_mains = false;  // of a charging post, where it can be told

  friend constexpr bool operator==(const ChargerOrder&, const ChargerOrder&) = default;
};

/// Of what a charger reports of its output, in tenths of a volt or an ampere: a bound of this program, as no source has
/// one. No pack file may have more.
inline constexpr std::int64_t charger_output_raw_max = 15'000;

/// Why a charger gives nothing, or less, in its own words. The number is the bit in ChargerReport::troubles.
enum class ChargerTrouble : std::uint8_t {
  hardware,
  too_hot,
  mains,               // voltage wrong, or no mains
  battery,             // reversed, or its voltage wrong
  no_command,          // it does not hear us
  command_refused,     // what it is told is out of its range
  output_overvoltage,  // more than it is to give
  unnamed,             // it reports an error and not, or not yet, which
  no_battery,          // none there or not started, or its voltage low
  no_mains,            // its mains voltage low
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

/// Those of these bits that are a trouble. While nothing is asked of a charger, it may be without a battery behind open
/// contactors, without mains behind a charging post, and without commands of a daemon that rests.
[[nodiscard]] std::uint16_t troubles_among(std::uint16_t bits, bool is_asked);

/// What a unit said last, each as it was told: not known until it was.
struct ChargerReport {
  SignalValue voltage_mV;  // at its output
  SignalValue current_mA;  // into the pack
  SignalValue mains_voltage_mV;
  SignalValue mains_current_mA;
  SignalValue temperature_dC;
  std::uint16_t troubles = 0;

  friend constexpr bool operator==(const ChargerReport&, const ChargerReport&) = default;
};

/// What a frame was for a charger's reports.
enum class ChargerWord : std::uint8_t {
  none,      // not a charger's
  refused,   // under a charger's identifier, and of a wrong length or form: nothing was taken from it
  values,    // voltage and current
  troubles,  // in a protocol that has frames of their own for them
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
  Duration command_life{};   // without one it stops by itself
  Duration report_period{};  // of voltage and current
  Duration slow_period{};    // of troubles and temperatures, where these have frames of their own; else zero
  std::uint8_t fast_count =
      0;              // where there is a slow period: so many frames of `reports` come with each report period
  Duration settle{};  // so long it may take to follow a command
  bool is_told_mains_current = false;
  bool can_request_mains = false;
  bool has_master_address = false;
  std::int32_t voltage_max_mV = 0;  // what a command can carry
  std::int32_t current_max_mA = 0;
  // What an emulated one does with its troubles; bits by ChargerTrouble.
  std::uint16_t reported_troubles = 0;  // that its reports have a word for
  std::uint16_t stopping_troubles = 0;  // of these: it gives nothing with them; the others are warnings
  std::uint16_t latched_troubles = 0;   // of those: they stay when their cause is gone, until a command clears them
  std::uint16_t supply_troubles = 0;    // of those: no command does, but its supply being switched off

  CanFrame (*command)(std::uint8_t unit, const ChargerOrder& order) = nullptr;
  /// Takes what a frame says into the report of `reports` that its unit has.
  ChargerNews (*take)(const CanFrame& frame, std::array<ChargerReport, charger_units_max>& reports) = nullptr;

  /// Whose command the identifier is, whatever else the frame is: what a charger makes of one of another length nobody
  /// knows. A remote frame commands nothing.
  std::optional<std::uint8_t> (*commanded_unit)(const CanFrame& frame) = nullptr;
  /// The other way: what a command says, if the frame is a whole one.
  std::optional<ChargerCommand> (*order_of)(const CanFrame& frame) = nullptr;
  /// And what a unit says that has this to report.
  ChargerFrames (*reports)(std::uint8_t unit, const ChargerReport& report) = nullptr;
};

}  // namespace bmu
