// Driver of a Brusa NLG5 charger. Its errors latch: they are cleared by a bit that goes from 0 to 1 and back.
#include "devices/brusa_nlg5/brusa_nlg5.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::brusa_nlg5 {

namespace {

/// Errors of each trouble. Masks of raw bits, as in the rows' names.
struct TroubleMask {
  ChargerTrouble trouble;
  std::uint8_t power;      // power_error_bits
  std::uint8_t sensor;     // sensor_error_bits
  std::uint8_t control;    // control_error_bits
  std::uint8_t emergency;  // emergency_bits
  std::uint8_t warning;    // warning_bits
};
constexpr std::array trouble_masks{
    TroubleMask{ChargerTrouble::hardware, 0x13, 0x7F, 0xFC, 0x30, 0x00},
    TroubleMask{ChargerTrouble::too_hot, 0x00, 0x00, 0x00, 0x00, 0x04},
    TroubleMask{ChargerTrouble::mains, 0x64, 0x00, 0x00, 0x00, 0x00},
    TroubleMask{ChargerTrouble::battery, 0x08, 0x80, 0x00, 0x0F, 0x00},
    TroubleMask{ChargerTrouble::no_command, 0x00, 0x00, 0x03, 0x00, 0x01},
    TroubleMask{ChargerTrouble::command_refused, 0x00, 0x00, 0x00, 0x00, 0x02},
    TroubleMask{ChargerTrouble::output_overvoltage, 0x80, 0x00, 0x00, 0x00, 0x00},
    TroubleMask{ChargerTrouble::no_battery, 0x00, 0x00, 0x00, 0x00, 0x08},
    TroubleMask{ChargerTrouble::no_mains, 0x00, 0x00, 0x00, 0x00, 0x10},
};

/// Troubles that stop the charger, by the bits that errors_frame() sets for them: the others are warnings, with which
/// it continues.
constexpr std::uint16_t stopping =
    bits_of_troubles(ChargerTrouble::hardware, ChargerTrouble::mains, ChargerTrouble::battery,
                     ChargerTrouble::no_command, ChargerTrouble::output_overvoltage, ChargerTrouble::unnamed);
constexpr std::uint16_t only_by_supply = bits_of_troubles(ChargerTrouble::hardware, ChargerTrouble::output_overvoltage);

CanFrame command(std::uint8_t /*unit*/, const ChargerOrder& order) {
  CanFrame frame = make_frame(control);
  write<control, "enable">(frame, order.is_enabled ? 1 : 0);
  write<control, "clear_errors">(frame, order.clears_errors ? 1 : 0);
  write<control, "mains_request">(frame, order.requests_mains ? 1 : 0);
  // All three must be valid numbers at all times.
  write<control, "mains_current_limit_mA">(frame, order.mains_current_mA);
  write<control, "output_voltage_limit_mV">(frame, order.voltage_mV);
  write<control, "output_current_limit_mA">(frame, order.is_enabled ? order.current_mA : 0);
  return frame;
}

std::uint16_t troubles_of(const CanFrame& frame) {
  const auto power = static_cast<std::uint8_t>(read_raw<errors, "power_error_bits">(frame));
  const auto sensor = static_cast<std::uint8_t>(read_raw<errors, "sensor_error_bits">(frame));
  const auto by_control = static_cast<std::uint8_t>(read_raw<errors, "control_error_bits">(frame));
  const auto emergency = static_cast<std::uint8_t>(read_raw<errors, "emergency_bits">(frame));
  const auto warning = static_cast<std::uint8_t>(read_raw<errors, "warning_bits">(frame));
  std::uint16_t troubles = 0;
  for (const TroubleMask& one : trouble_masks) {
    const unsigned found = (power & one.power) | (sensor & one.sensor) | (by_control & one.control) |
                           (emergency & one.emergency) | (warning & one.warning);
    if (found != 0) troubles |= bit_of(one.trouble);
  }
  return troubles;
}

/// The status is sent ten times as often as the errors, and indicates that there is an error but not which one.
void note_error(bool has_error, ChargerReport& report) {
  constexpr std::uint16_t unnamed = bit_of(ChargerTrouble::unnamed);
  const bool is_named = (report.troubles & static_cast<std::uint16_t>(~unnamed)) != 0;
  if (has_error && !is_named) report.troubles |= unnamed;
  if (!has_error) report.troubles &= static_cast<std::uint16_t>(~unnamed);
}

ChargerNews take(const CanFrame& frame, std::array<ChargerReport, charger_units_max>& reports) {
  if (frame.is_extended || frame.is_error) return {};
  const MessageSpec* const message = catalogue.find(frame.id).message;
  if (message == nullptr || message->sender != Sender::charger) return {};
  if (frame.is_remote || content_fault(*message, frame)) return {ChargerWord::refused, 0};
  ChargerReport& report = reports.front();
  if (message == &actual_1) {
    report.mains_current_mA = read<actual_1, "mains_current_mA">(frame);
    report.mains_voltage_mV = read<actual_1, "mains_voltage_mV">(frame);
    report.voltage_mV = read<actual_1, "output_voltage_mV">(frame);
    report.current_mA = read<actual_1, "output_current_mA">(frame);
    return {ChargerWord::values, 0};
  }
  if (message == &temperatures) report.temperature_dC = read<temperatures, "power_stage_temperature_dC">(frame);
  if (message == &status) note_error(read_raw<status, "error">(frame) != 0, report);
  if (message != &errors) return {ChargerWord::other, 0};
  const std::uint16_t named = troubles_of(frame);
  report.troubles = named != 0 ? named : report.troubles & bit_of(ChargerTrouble::unnamed);
  return {ChargerWord::troubles, 0};
}

std::optional<std::uint8_t> commanded_unit(const CanFrame& frame) {
  const bool is_control = frame.id == control.base_id && !frame.is_extended && !frame.is_remote && !frame.is_error;
  return is_control ? std::optional(std::uint8_t{0}) : std::nullopt;
}

std::optional<ChargerCommand> order_of(const CanFrame& frame) {
  if (!commanded_unit(frame) || frame.length != control.length) return std::nullopt;
  const auto number = [](const SignalValue& value) { return static_cast<std::int32_t>(value.value); };
  return ChargerCommand{.order = {.is_enabled = read_raw<control, "enable">(frame) != 0,
                                  .voltage_mV = number(read<control, "output_voltage_limit_mV">(frame)),
                                  .current_mA = number(read<control, "output_current_limit_mA">(frame)),
                                  .mains_current_mA = number(read<control, "mains_current_limit_mA">(frame)),
                                  .clears_errors = read_raw<control, "clear_errors">(frame) != 0,
                                  .requests_mains = read_raw<control, "mains_request">(frame) != 0}};
}

std::int64_t value_or_0(const SignalValue& value) {
  return value.is_valid() ? value.value : 0;
}

/// One bit for each trouble: power stage short, mains voltage implausible or low, output voltage implausible, battery
/// voltage low, output overvoltage, no control message, charger hot, command out of range. A power stage short and an
/// output overvoltage are cleared only by switching its supply off.
CanFrame errors_frame(std::uint16_t troubles) {
  CanFrame frame = make_frame(errors);
  std::int64_t power = 0;
  std::int64_t by_control = 0;
  std::int64_t warning = 0;
  const auto has = [troubles](ChargerTrouble trouble) { return (troubles & bit_of(trouble)) != 0; };
  if (has(ChargerTrouble::hardware)) power |= 0x10;
  if (has(ChargerTrouble::mains)) power |= 0x04;
  if (has(ChargerTrouble::no_mains)) warning |= 0x10;
  if (has(ChargerTrouble::battery)) power |= 0x08;
  if (has(ChargerTrouble::no_battery)) warning |= 0x08;
  if (has(ChargerTrouble::output_overvoltage)) power |= 0x80;
  if (has(ChargerTrouble::no_command)) by_control |= 0x02;
  if (has(ChargerTrouble::too_hot)) warning |= 0x04;
  if (has(ChargerTrouble::command_refused)) warning |= 0x02;
  write<errors, "power_error_bits">(frame, power);
  write<errors, "control_error_bits">(frame, by_control);
  write<errors, "warning_bits">(frame, warning);
  return frame;
}

ChargerFrames reports(std::uint8_t /*unit*/, const ChargerReport& report) {
  ChargerFrames frames;
  CanFrame state = make_frame(status);
  write<status, "error">(state, (report.troubles & stopping) != 0 ? 1 : 0);
  write<status, "warning">(state, (report.troubles & static_cast<std::uint16_t>(~stopping)) != 0 ? 1 : 0);
  frames.push_back(state);
  CanFrame actual = make_frame(actual_1);
  write<actual_1, "mains_current_mA">(actual, value_or_0(report.mains_current_mA));
  write<actual_1, "mains_voltage_mV">(actual, value_or_0(report.mains_voltage_mV));
  write<actual_1, "output_voltage_mV">(actual, value_or_0(report.voltage_mV));
  write<actual_1, "output_current_mA">(actual, value_or_0(report.current_mA));
  frames.push_back(actual);
  CanFrame more = make_frame(actual_2);
  write<actual_2, "auxiliary_voltage_mV">(more, 12'000);
  frames.push_back(more);
  CanFrame heat = make_frame(temperatures);
  write<temperatures, "power_stage_temperature_dC">(heat, value_or_0(report.temperature_dC));
  frames.push_back(heat);
  frames.push_back(errors_frame(report.troubles));
  return frames;
}

}  // namespace

const ChargerDriver driver{.name = "brusa_nlg5",
                           .unit_count_max = 1,
                           .command_period = 100ms,
                           .command_life = control_life,
                           .report_period = 100ms,
                           .slow_period = 1s,
                           .fast_count = 3,
                           .settle = 2s,
                           .is_told_mains_current = true,
                           .can_request_mains = true,
                           .voltage_max_mV = 0xFFFF * 100,
                           .current_max_mA = 0xFFFF * 100,
                           .reported_troubles = (1U << charger_trouble_count) - 1U,
                           .stopping_troubles = stopping,
                           .latched_troubles = stopping,
                           .supply_troubles = only_by_supply,
                           .command = command,
                           .take = take,
                           .commanded_unit = commanded_unit,
                           .order_of = order_of,
                           .reports = reports};

}  // namespace bmu::brusa_nlg5
