// Driver of inverters that support Pylontech's batteries. Unknown values are not sent: the document defines no code for
// them.
#include "devices/inverter_frames.hpp"
#include "devices/pylontech/pylontech.hpp"

namespace bmu::pylontech {

namespace {

constexpr bool has_codes = false;

enum class Frame : std::uint8_t { limits, requests, charge, measurements, alarms, name };
constexpr std::uint8_t frame_count = 6;
constexpr std::uint8_t urgent_count = 2;  // the permissions follow the limits

/// Alarms of each bit of 359h. Those for which the document has no bit are a system error.
struct AlarmBit {
  std::size_t protection;
  std::size_t alarm;
  std::uint16_t alarms;
};
template <class... Alarms>
constexpr std::uint16_t bits_of(Alarms... all) {
  return static_cast<std::uint16_t>((bit_of(all) | ...));
}
constexpr std::array alarm_bits{
    AlarmBit{signal_index(alarms, "protection_discharge_overcurrent"),
             signal_index(alarms, "alarm_discharge_overcurrent"),
             bits_of(BatteryAlarm::high_current, BatteryAlarm::short_circuit)},
    AlarmBit{signal_index(alarms, "protection_cold"), signal_index(alarms, "alarm_cold"),
             bits_of(BatteryAlarm::cold, BatteryAlarm::cold_to_charge)},
    AlarmBit{signal_index(alarms, "protection_hot"), signal_index(alarms, "alarm_hot"),
             bits_of(BatteryAlarm::hot, BatteryAlarm::hot_to_charge)},
    AlarmBit{signal_index(alarms, "protection_undervoltage"), signal_index(alarms, "alarm_undervoltage"),
             bits_of(BatteryAlarm::low_voltage)},
    AlarmBit{signal_index(alarms, "protection_overvoltage"), signal_index(alarms, "alarm_overvoltage"),
             bits_of(BatteryAlarm::high_voltage)},
    AlarmBit{signal_index(alarms, "protection_system_error"), signal_index(alarms, "alarm_internal_communication"),
             bits_of(BatteryAlarm::general, BatteryAlarm::contactor, BatteryAlarm::internal, BatteryAlarm::imbalance,
                     BatteryAlarm::communication)},
    AlarmBit{signal_index(alarms, "protection_charge_overcurrent"), signal_index(alarms, "alarm_charge_overcurrent"),
             bits_of(BatteryAlarm::high_charge_current)},
};

CanFrame alarms_frame(const BatteryReport& report, const InverterOptions& options) {
  CanFrame frame = inverter::empty_frame(alarms, options);
  for (const AlarmBit& one : alarm_bits) {
    encode_signal(alarm_signals[one.protection], known((report.alarms & one.alarms) != 0 ? 1 : 0), frame.data);
    encode_signal(alarm_signals[one.alarm], known((report.warnings & one.alarms) != 0 ? 1 : 0), frame.data);
  }
  write<alarms, "module_count">(frame, report.module_count);
  frame.data[5] = 'P';
  frame.data[6] = 'N';
  return frame;
}

CanFrame requests_frame(const BatteryReport& report, const InverterOptions& options) {
  CanFrame frame = inverter::empty_frame(requests, options);
  write<requests, "charge_enabled">(frame, report.may_charge ? 1 : 0);
  write<requests, "discharge_enabled">(frame, report.may_discharge ? 1 : 0);
  // An inverter may follow either of the two.
  write<requests, "force_charge_1">(frame, report.asks_for_charge ? 1 : 0);
  write<requests, "force_charge_2">(frame, report.asks_for_charge ? 1 : 0);
  write<requests, "full_charge_request">(frame, report.asks_for_full_charge ? 1 : 0);
  return frame;
}

std::optional<CanFrame> frame(std::size_t index, const BatteryReport& report, const InverterOptions& options) {
  switch (static_cast<Frame>(index)) {
    case Frame::limits: return inverter::limits_frame(limits, report, options);
    case Frame::requests: return requests_frame(report, options);
    case Frame::charge: return inverter::charge_frame(charge, report, options, has_codes);
    case Frame::measurements: return inverter::measurements_frame(measurements, report, options, has_codes);
    case Frame::alarms: return alarms_frame(report, options);
    case Frame::name: break;
  }
  return inverter::name_frame(name, report, driver.default_name);
}

InverterWord take(const CanFrame& frame, InverterReport& /*report*/) {
  return inverter::take_keep_alive(catalogue, frame);
}

BatteryWord hear(const CanFrame& frame, BatteryReport& report) {
  const inverter::Heard heard = inverter::heard_as(catalogue, Sender::bmu, frame);
  if (heard.message == nullptr) return BatteryWord::none;
  if (heard.is_refused) return BatteryWord::refused;
  if (heard.message == &limits) {
    inverter::hear_limits(limits, frame, report);
    return BatteryWord::limits;
  }
  if (heard.message != &requests) return BatteryWord::other;
  report.may_charge = read_raw<requests, "charge_enabled">(frame) != 0;
  report.may_discharge = read_raw<requests, "discharge_enabled">(frame) != 0;
  report.asks_for_charge =
      read_raw<requests, "force_charge_1">(frame) != 0 || read_raw<requests, "force_charge_2">(frame) != 0;
  report.asks_for_full_charge = read_raw<requests, "full_charge_request">(frame) != 0;
  return BatteryWord::requests;
}

InverterFrames words(const InverterReport& /*report*/) {
  return inverter::keep_alive_only(keep_alive);
}

}  // namespace

const InverterDriver driver{.name = "pylontech",
                            .default_name = "PYLON",
                            .frame_count = frame_count,
                            .urgent_count = urgent_count,
                            .period_min = 200ms,
                            .battery_life = 5s,
                            .keep_alive_period = 1s,
                            .frame = frame,
                            .take = take,
                            .hear = hear,
                            .words = words};

}  // namespace bmu::pylontech
