// Driver of SMA battery inverters. Only this protocol has codes for unknown values.
#include "devices/inverter_frames.hpp"
#include "devices/sma/sma.hpp"

namespace bmu::sma {

namespace {

constexpr std::string_view default_name = "BMUD";
constexpr inverter::CommonRows common{&limits, &charge, &measurements, &items, &name, true, default_name};

/// No list of types, versions and manufacturers' numbers is available.
CanFrame battery_frame(const BatteryReport& report) {
  CanFrame frame = make_frame(battery);
  write<battery, "battery_type">(frame, not_known());
  write<battery, "bms_version">(frame, not_known());
  write<battery, "capacity_or_charge_left_uAs">(frame, report.capacity_uAs);
  write<battery, "manufacturer_id">(frame, not_known());
  return frame;
}

std::optional<CanFrame> frame(std::size_t index, const BatteryReport& report, const InverterOptions& options) {
  if (index < inverter::common_count) return inverter::common_frame(index, common, report, options);
  return battery_frame(report);
}

InverterWord take(const CanFrame& frame, InverterReport& report) {
  const inverter::Heard heard = inverter::heard_as(catalogue, Sender::inverter, frame);
  if (heard.message == nullptr) return InverterWord::none;
  if (heard.is_refused) return InverterWord::refused;
  report.values_out_of_range += inverter::out_of_range_in(*heard.message, frame);
  if (heard.message == &inverter_values) {
    report.voltage_mV = read<inverter_values, "battery_voltage_mV">(frame);
    report.current_mA = read<inverter_values, "battery_current_mA">(frame);
    report.temperature_dC = read<inverter_values, "battery_temperature_dC">(frame);
    return InverterWord::alive;
  }
  const SignalValue state = read<inverter_state, "state">(frame);
  // A state without a meaning neither reports a failure nor ends one.
  if (state.is_valid()) {
    report.has_failed = state.value == static_cast<std::int64_t>(State::failure);
    report.has_warning = state.value == static_cast<std::int64_t>(State::warning);
  }
  report.error_number = static_cast<std::uint16_t>(read_raw<inverter_state, "error_number">(frame));
  return InverterWord::other;
}

BatteryWord hear(const CanFrame& frame, BatteryReport& report) {
  return inverter::hear_limits_only(catalogue, limits, &items, frame, report);
}

InverterFrames words(const InverterReport& report) {
  CanFrame values = make_frame(inverter_values);
  write<inverter_values, "battery_voltage_mV">(values, report.voltage_mV);
  write<inverter_values, "battery_current_mA">(values, report.current_mA);
  write<inverter_values, "battery_temperature_dC">(values, report.temperature_dC);
  write<inverter_values, "soc_permille">(values, not_known());
  CanFrame state = make_frame(inverter_state);
  const State now = report.has_failed ? State::failure : report.has_warning ? State::warning : State::operating;
  write<inverter_state, "soh_permille">(state, not_known());
  write<inverter_state, "state">(state, static_cast<std::int64_t>(now));
  write<inverter_state, "error_number">(state, report.error_number);
  write<inverter_state, "charge_voltage_wanted_mV">(state, not_known());
  InverterFrames frames;
  frames.push_back(values);
  frames.push_back(state);
  return frames;
}

}  // namespace

const InverterDriver driver{.name = "sma",
                            .default_name = default_name,
                            .frame_count = inverter::common_count + 1,
                            .period_min = period_min,
                            .battery_life = battery_life,
                            .keep_alive_period = 1s,
                            .stops_at_alarm = true,
                            .frame = frame,
                            .take = take,
                            .hear = hear,
                            .words = words};

}  // namespace bmu::sma
