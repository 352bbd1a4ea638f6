#include <algorithm>

#include "devices/inverter_frames.hpp"

namespace bmu::inverter {

namespace {

constexpr std::size_t item_count = std::size(item_signals) / 2;
constexpr std::int64_t raised = 1;
constexpr std::int64_t cleared = 2;

static_assert(item_count == static_cast<std::size_t>(BatteryAlarm::communication),
              "35Ah has an item for each alarm but the last");

/// A communication failure counts as an internal error in protocols without an item for it.
std::uint16_t as_items(std::uint16_t alarms) {
  const bool has_failed = (alarms & bit_of(BatteryAlarm::communication)) != 0;
  return has_failed ? alarms | bit_of(BatteryAlarm::internal) : alarms;
}

SignalValue as_told(const SignalValue& current_mA, const InverterOptions& options) {
  if (!current_mA.is_valid() || options.is_discharge_positive) return current_mA;
  return known(-current_mA.value);
}

/// Whether b6-7 of 351h are the discharge voltage limit in this protocol, and not just filled by some batteries.
bool has_discharge_voltage(const MessageSpec& limits) {
  constexpr std::uint8_t length_without = 6;
  return limits.shortest() > length_without;
}

/// A voltage or current beyond the range of its field becomes unknown rather than the largest number that fits.
SignalValue as_carried(const SignalSpec& signal, const SignalValue& value) {
  if (!value.is_valid()) return value;
  const RawRange range = raw_range(signal);
  const bool fits = value.value >= range.min * signal.scale && value.value <= range.max * signal.scale;
  return fits ? value : not_known(Validity::out_of_range);
}

std::int32_t number_or_0(const SignalValue& value) {
  return value.is_valid() ? static_cast<std::int32_t>(value.value) : 0;
}

}  // namespace

CanFrame empty_frame(const MessageSpec& message, const InverterOptions& options) {
  CanFrame frame = make_frame(message);
  if (options.has_short_frames) frame.length = message.shortest();
  return frame;
}

CanFrame limits_frame(const MessageSpec& message, const BatteryReport& report, const InverterOptions& options) {
  CanFrame frame = empty_frame(message, options);
  encode_signal(charge_voltage_limit, known(report.charge_voltage_limit_mV), frame.data);
  encode_signal(charge_current_limit, known(report.charge_limit_mA), frame.data);
  encode_signal(discharge_current_limit, known(report.discharge_limit_mA), frame.data);
  if (!has_discharge_voltage(message)) return frame;
  // Rounded up: a step below would allow the cells to be discharged further.
  const std::int64_t step_mV = discharge_voltage_limit.scale;
  const std::int64_t up_mV = (report.discharge_voltage_limit_mV + step_mV - 1) / step_mV * step_mV;
  encode_signal(discharge_voltage_limit, known(up_mV), frame.data);
  return frame;
}

std::optional<CanFrame> charge_frame(const MessageSpec& message, const BatteryReport& report,
                                     const InverterOptions& options, bool has_codes) {
  constexpr std::int64_t ppm_per_permille = 1'000;
  const bool is_known = report.soc_permille.is_valid() && report.soh_permille.is_valid();
  if (!is_known && !has_codes) return std::nullopt;
  CanFrame frame = empty_frame(message, options);
  encode_signal(soc, report.soc_permille, frame.data);
  encode_signal(soh, report.soh_permille, frame.data);
  if (message.signals.size() < std::size(charge_signals)) return frame;
  // In tenths of a percent with some, in hundredths with others.
  const SignalSpec& fine = message.signals[2];
  const std::int64_t per_permille = fine.unit == Unit::ppm ? ppm_per_permille : 1;
  const SignalValue& told = report.soc_permille;
  encode_signal(fine, told.is_valid() ? known(told.value * per_permille) : told, frame.data);
  return frame;
}

std::optional<CanFrame> measurements_frame(const MessageSpec& message, const BatteryReport& report,
                                           const InverterOptions& options, bool has_codes) {
  const std::array values{as_carried(message.signals[0], report.voltage_mV),
                          as_carried(message.signals[1], as_told(report.current_mA, options)),
                          as_carried(message.signals[2], report.temperature_dC)};
  const bool is_known =
      std::all_of(values.begin(), values.end(), [](const SignalValue& one) { return one.is_valid(); });
  if (!is_known && !has_codes) return std::nullopt;
  CanFrame frame = empty_frame(message, options);
  for (std::size_t index = 0; index < values.size(); ++index) {
    encode_signal(message.signals[index], values[index], frame.data);
  }
  return frame;
}

CanFrame items_frame(const MessageSpec& message, const BatteryReport& report) {
  CanFrame frame = make_frame(message);
  const std::array told{as_items(report.alarms), as_items(report.warnings)};
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    const bool holds = (told[index / item_count] >> (index % item_count) & 1U) != 0;
    encode_signal(message.signals[index], known(holds ? raised : cleared), frame.data);
  }
  return frame;
}

CanFrame name_frame(const MessageSpec& message, const BatteryReport& report, std::string_view default_name) {
  CanFrame frame = make_frame(message);
  frame.data.fill(' ');
  if (report.name.front() != '\0') {
    std::copy(report.name.begin(), report.name.end(), frame.data.begin());
  } else {
    std::copy(default_name.begin(), default_name.end(), frame.data.begin());
  }
  return frame;
}

std::optional<CanFrame> common_frame(std::size_t index, const CommonRows& rows, const BatteryReport& report,
                                     const InverterOptions& options) {
  switch (index) {
    case 0: return limits_frame(*rows.limits, report, options);
    case 1: return charge_frame(*rows.charge, report, options, rows.has_codes);
    case 2: return measurements_frame(*rows.measurements, report, options, rows.has_codes);
    case 3: return items_frame(*rows.items, report);
    default: return name_frame(*rows.name, report, rows.default_name);
  }
}

Heard heard_as(const Catalogue& catalogue, Sender sender, const CanFrame& frame) {
  if (frame.is_extended || frame.is_error) return {};
  const MessageSpec* const message = catalogue.find(frame.id).message;
  if (message == nullptr || message->sender != sender) return {};
  return {message, frame.is_remote || frame.length < message->shortest() || frame.length > message->length};
}

std::uint64_t out_of_range_in(const MessageSpec& message, const CanFrame& frame) {
  return static_cast<std::uint64_t>(
      std::count_if(message.signals.begin(), message.signals.end(), [&frame](const SignalSpec& signal) {
        return decode_signal(signal, frame.data).validity == Validity::out_of_range;
      }));
}

void hear_limits(const MessageSpec& message, const CanFrame& frame, BatteryReport& report) {
  report.charge_voltage_limit_mV = number_or_0(decode_signal(charge_voltage_limit, frame.data));
  report.charge_limit_mA = number_or_0(decode_signal(charge_current_limit, frame.data));
  report.discharge_limit_mA = number_or_0(decode_signal(discharge_current_limit, frame.data));
  if (!has_discharge_voltage(message)) return;
  report.discharge_voltage_limit_mV = number_or_0(decode_signal(discharge_voltage_limit, frame.data));
}

void hear_items(const MessageSpec& message, const CanFrame& frame, BatteryReport& report) {
  const std::array told{&report.alarms, &report.warnings};
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    const SignalValue change = decode_signal(message.signals[index], frame.data);
    const auto bit = static_cast<std::uint16_t>(1U << (index % item_count));
    std::uint16_t& items = *told[index / item_count];
    if (change == known(raised)) items |= bit;
    if (change == known(cleared)) items &= static_cast<std::uint16_t>(~bit);
  }
}

BatteryWord hear_limits_only(const Catalogue& catalogue, const MessageSpec& limits, const MessageSpec* items,
                             const CanFrame& frame, BatteryReport& report) {
  const Heard heard = heard_as(catalogue, Sender::bmu, frame);
  if (heard.message == nullptr) return BatteryWord::none;
  if (heard.is_refused) return BatteryWord::refused;
  if (heard.message == items) hear_items(*items, frame, report);
  if (heard.message != &limits) return BatteryWord::other;
  hear_limits(limits, frame, report);
  report.may_charge = report.charge_limit_mA > 0;
  report.may_discharge = report.discharge_limit_mA > 0;
  return BatteryWord::limits;
}

InverterWord take_keep_alive(const Catalogue& catalogue, const CanFrame& frame) {
  const Heard heard = heard_as(catalogue, Sender::inverter, frame);
  if (heard.message == nullptr) return InverterWord::none;
  return heard.is_refused ? InverterWord::refused : InverterWord::alive;
}

InverterFrames keep_alive_only(const MessageSpec& message) {
  InverterFrames frames;
  frames.push_back(make_frame(message));
  return frames;
}

}  // namespace bmu::inverter
