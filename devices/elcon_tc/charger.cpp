// Driver of Elcon and TC chargers. The identifier gives the unit.
#include <algorithm>

#include "devices/elcon_tc/elcon_tc.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::elcon_tc {

namespace {

/// Rows of one unit, used to read and write the frames of all: all have the same signals.
constexpr const MessageSpec& any_command = command_e5;
constexpr const MessageSpec& any_status = status_e5;

std::optional<std::uint8_t> unit_of(const CanFrame& frame, const UnitRows& rows) {
  if (!frame.is_extended || frame.is_error) return std::nullopt;
  const auto* const found =
      std::find_if(rows.begin(), rows.end(), [&](const MessageSpec* row) { return row->base_id == frame.id; });
  if (found == rows.end()) return std::nullopt;
  return static_cast<std::uint8_t>(found - rows.begin());
}

bool is_whole(const CanFrame& frame) {
  return !frame.is_remote && frame.length == 8;
}

struct TroubleBit {
  ChargerTrouble trouble;
  std::size_t signal;
};
constexpr std::array trouble_bits{
    TroubleBit{ChargerTrouble::hardware, signal_index(any_status, "hardware_failure")},
    TroubleBit{ChargerTrouble::too_hot, signal_index(any_status, "charger_too_hot")},
    TroubleBit{ChargerTrouble::mains, signal_index(any_status, "mains_voltage_wrong")},
    TroubleBit{ChargerTrouble::no_battery, signal_index(any_status, "battery_not_connected")},
    TroubleBit{ChargerTrouble::no_command, signal_index(any_status, "communication_timeout")},
};

CanFrame command(std::uint8_t unit, const ChargerOrder& order) {
  const UnitRows& rows = command_rows.at(static_cast<std::size_t>(order.master_address));
  CanFrame frame = make_frame(*rows.at(unit));
  write<any_command, "voltage_limit_mV">(frame, order.voltage_mV);
  write<any_command, "current_limit_mA">(frame, order.is_enabled ? order.current_mA : 0);
  write<any_command, "control">(frame, static_cast<std::int64_t>(order.is_enabled ? Control::charge : Control::stop));
  return frame;
}

ChargerNews take(const CanFrame& frame, std::array<ChargerReport, charger_units_max>& reports) {
  const std::optional<std::uint8_t> unit = unit_of(frame, status_rows);
  if (!unit) return {};
  if (!is_whole(frame)) return {ChargerWord::refused, *unit};
  ChargerReport& report = reports.at(*unit);
  report.voltage_mV = read<any_status, "output_voltage_mV">(frame);
  report.current_mA = read<any_status, "output_current_mA">(frame);
  report.troubles = 0;
  for (const TroubleBit& one : trouble_bits) {
    if (raw_of(status_signals[one.signal], frame.data) != 0) report.troubles |= bit_of(one.trouble);
  }
  return {ChargerWord::values, *unit};
}

/// With either address of a master.
std::optional<std::uint8_t> commanded_unit(const CanFrame& frame) {
  if (frame.is_remote) return std::nullopt;
  const std::optional<std::uint8_t> unit_of_f4 = unit_of(frame, command_rows.front());
  return unit_of_f4 ? unit_of_f4 : unit_of(frame, command_rows.back());
}

std::optional<ChargerCommand> order_of(const CanFrame& frame) {
  const std::optional<std::uint8_t> unit = commanded_unit(frame);
  if (!unit || !is_whole(frame)) return std::nullopt;
  const bool is_of_f4 = unit_of(frame, command_rows.front()).has_value();
  const auto control = static_cast<Control>(read_raw<any_command, "control">(frame));
  return ChargerCommand{
      .unit = *unit,
      .order = {.master_address = is_of_f4 ? MasterAddress::f4 : MasterAddress::f5,
                .is_enabled = control == Control::charge,
                .voltage_mV = static_cast<std::int32_t>(read<any_command, "voltage_limit_mV">(frame).value),
                .current_mA = static_cast<std::int32_t>(read<any_command, "current_limit_mA">(frame).value)}};
}

ChargerFrames reports(std::uint8_t unit, const ChargerReport& report) {
  CanFrame frame = make_frame(*status_rows.at(unit));
  write<any_status, "output_voltage_mV">(frame, report.voltage_mV.is_valid() ? report.voltage_mV.value : 0);
  write<any_status, "output_current_mA">(frame, report.current_mA.is_valid() ? report.current_mA.value : 0);
  write<any_status, "charging">(frame, report.current_mA.is_valid() && report.current_mA.value > 0 ? 1 : 0);
  for (const TroubleBit& one : trouble_bits) {
    const bool is_set = (report.troubles & bit_of(one.trouble)) != 0;
    encode_signal(status_signals[one.signal], known(is_set ? 1 : 0), frame.data);
  }
  ChargerFrames frames;
  frames.push_back(frame);
  return frames;
}

/// With any of these a charger gives no output; without them it continues by itself.
constexpr std::uint16_t all_troubles() {
  std::uint16_t bits = 0;
  for (const TroubleBit& one : trouble_bits) bits |= bit_of(one.trouble);
  return bits;
}

}  // namespace

const ChargerDriver driver{.name = "elcon_tc",
                           .unit_count_max = unit_count_max,
                           .command_period = 500ms,
                           .command_life = command_life,
                           .report_period = 1s,
                           .settle = 5s,
                           .has_master_address = true,
                           .voltage_max_mV = 0xFFFF * 100,
                           .current_max_mA = 0xFFFF * 100,
                           .reported_troubles = all_troubles(),
                           .stopping_troubles = all_troubles(),
                           .command = command,
                           .take = take,
                           .commanded_unit = commanded_unit,
                           .order_of = order_of,
                           .reports = reports};

}  // namespace bmu::elcon_tc
