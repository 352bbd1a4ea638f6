// Elcon and TC chargers (HK-J and related ones), as their manufacturer describes them and as other programs drive them:
// 29-bit identifiers, big-endian. Up to four on one bus, distinguished by their address E5, E7, E8 or E9; the firmware
// CAN1430 has E5, CAN998 has E7, CAN997 has E8.
//
// A charger that receives no command for 5 s stops, and continues by itself with the next one.
//
// Sources disagree on:
//   - the bit rate: 250 kbit/s for 1.8 and 3.3 kW, 500 kbit/s for 6.6 kW;
//   - b4 of the command: 0 and 1 are certain, 2 (sleep) and b5 (1 = heating) are of newer firmware;
//   - b4 .3 of the status: "starting", "charging disabled", or battery missing or reversed. Read here as the last;
//   - b4 .5 of the status is set by a unit that charges, and b6 and b7 are not 0 on every unit;
//   - b5 of the status is a temperature from -100 C on some units only: on another one it would be -23 C while that
//     charges. It is a signal for the dump alone, and the driver reports no temperature. 0, which would be -100 C,
//     means none.
// The source address of a master is F4 or F5. The daemon sends with the one of the pack file (charger/master_address);
// a command with the other one, or with its own from another node, is that of a second master.
#pragma once

#include <array>

#include "devices/device.hpp"
#include "devices/fields.hpp"

namespace bmu::elcon_tc {

enum class Control : std::uint8_t { charge = 0, stop = 1, sleep = 2 };
inline constexpr RawName control_names[] = {{0, "charge"}, {1, "stop"}, {2, "sleep"}};
inline constexpr RawName mode_names[] = {{0, "charging"}, {1, "heating"}};
inline constexpr SpecialCode temperature_codes[] = {{0, Validity::not_fitted}};

/// A charger stops after this time without a command.
inline constexpr Duration command_life = 5s;

inline constexpr SignalSpec command_signals[] = {
    field::as_limit(field::big("voltage_limit_mV", 0, 2, field::tenth_of_V)),
    field::as_limit(field::big("current_limit_mA", 2, 2, field::tenth_of_A)),
    field::within(0, 2, field::named(field::u8("control", 4), control_names)),
    field::within(0, 1, field::named(field::u8("mode", 5), mode_names)),
};
inline constexpr SignalSpec status_signals[] = {
    field::within(0, charger_output_raw_max, field::big("output_voltage_mV", 0, 2, field::tenth_of_V)),
    field::within(0, charger_output_raw_max, field::big("output_current_mA", 2, 2, field::tenth_of_A)),
    field::flag("charging", 4, 5),
    field::flag("communication_timeout", 4, 4),
    field::flag("battery_not_connected", 4, 3),
    field::flag("mains_voltage_wrong", 4, 2),
    field::flag("charger_too_hot", 4, 1),
    field::flag("hardware_failure", 4, 0),
    field::u8("possible_temperature_dC", 5, field::degrees_from(-100), temperature_codes),
};

namespace detail {

/// The address of a charger is the third digit pair of a command's identifier and the last of a status's; that of the
/// master is the last of a command's.
consteval MessageSpec command(std::string_view name, std::uint32_t address, std::uint32_t master) {
  return {.name = name,
          .base_id = 0x1806'0000 | address << 8U | master,
          .is_extended = true,
          .sender = Sender::bmu,
          .period = 1s,
          .signals = command_signals,
          .meaning = "the most a charger may give, and whether it is to"};
}
consteval MessageSpec status(std::string_view name, std::uint32_t address) {
  return {.name = name,
          .base_id = 0x18FF'5000 | address,
          .is_extended = true,
          .sender = Sender::charger,
          .period = 1s,
          .signals = status_signals,
          .meaning = "what a charger gives, and what is wrong with it"};
}

}  // namespace detail

inline constexpr MessageSpec command_e5 = detail::command("ELCON_COMMAND_E5", 0xE5, 0xF4);
inline constexpr MessageSpec command_e7 = detail::command("ELCON_COMMAND_E7", 0xE7, 0xF4);
inline constexpr MessageSpec command_e8 = detail::command("ELCON_COMMAND_E8", 0xE8, 0xF4);
inline constexpr MessageSpec command_e9 = detail::command("ELCON_COMMAND_E9", 0xE9, 0xF4);
inline constexpr MessageSpec command_e5_of_f5 = detail::command("ELCON_COMMAND_E5_F5", 0xE5, 0xF5);
inline constexpr MessageSpec command_e7_of_f5 = detail::command("ELCON_COMMAND_E7_F5", 0xE7, 0xF5);
inline constexpr MessageSpec command_e8_of_f5 = detail::command("ELCON_COMMAND_E8_F5", 0xE8, 0xF5);
inline constexpr MessageSpec command_e9_of_f5 = detail::command("ELCON_COMMAND_E9_F5", 0xE9, 0xF5);
inline constexpr MessageSpec status_e5 = detail::status("ELCON_STATUS_E5", 0xE5);
inline constexpr MessageSpec status_e7 = detail::status("ELCON_STATUS_E7", 0xE7);
inline constexpr MessageSpec status_e8 = detail::status("ELCON_STATUS_E8", 0xE8);
inline constexpr MessageSpec status_e9 = detail::status("ELCON_STATUS_E9", 0xE9);

/// Rows by unit, 0 to 3; all have the same signals.
inline constexpr std::size_t unit_count_max = 4;
using UnitRows = std::array<const MessageSpec*, unit_count_max>;
inline constexpr UnitRows status_rows{&status_e5, &status_e7, &status_e8, &status_e9};
/// Rows by MasterAddress.
inline constexpr std::array<UnitRows, 2> command_rows{
    UnitRows{&command_e5, &command_e7, &command_e8, &command_e9},
    UnitRows{&command_e5_of_f5, &command_e7_of_f5, &command_e8_of_f5, &command_e9_of_f5}};

inline constexpr const MessageSpec* rows[] = {
    &command_e5, &status_e5, &command_e7,       &status_e7,        &command_e8,       &status_e8,
    &command_e9, &status_e9, &command_e5_of_f5, &command_e7_of_f5, &command_e8_of_f5, &command_e9_of_f5};
inline constexpr Catalogue catalogue{"elcon_tc", rows};

inline constexpr std::uint32_t bit_rates[] = {bit_rate_250k, bit_rate_500k};
extern const ChargerDriver driver;

inline constexpr Device device{.name = "elcon_tc",
                               .title = "Elcon / TC (HK-J) charger",
                               .kind = DeviceKind::charger,
                               .catalogue = &catalogue,
                               .bit_rates = bit_rates,
                               .meaning = "up to four chargers, each with a command and a status of its own",
                               .charger = &driver};

}  // namespace bmu::elcon_tc
