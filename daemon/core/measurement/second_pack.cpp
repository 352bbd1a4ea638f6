#include "daemon/core/measurement/second_pack.hpp"

#include <algorithm>

#include "protocol/message.hpp"

namespace bmu {

namespace {

constexpr std::uint32_t message_count = std::size(vehicle_bus::rows);
constexpr std::uint32_t name_index = 0;
constexpr std::uint32_t status_index = 2;
constexpr std::uint32_t charge_index = 6;
/// Length of 622h and 626h in every revision.
constexpr std::uint8_t old_length = 6;

/// Destination of a signal. The names are the same in all dialects.
struct ValueRow {
  std::string_view signal;
  Measured<std::int32_t> SecondPack::Values::*value;
};
constexpr std::string_view state_name = "state";  // elithion has bits instead
constexpr ValueRow value_rows[] = {
    {state_name, &SecondPack::Values::state},
    {"pack_voltage_mV", &SecondPack::Values::pack_voltage_mV},
    {"cell_voltage_min_uV", &SecondPack::Values::cell_voltage_min_uV},
    {"cell_voltage_max_uV", &SecondPack::Values::cell_voltage_max_uV},
    {"pack_current_mA", &SecondPack::Values::current_mA},
    {"charge_limit_mA", &SecondPack::Values::charge_limit_mA},
    {"discharge_limit_mA", &SecondPack::Values::discharge_limit_mA},
    {"soc_permille", &SecondPack::Values::soc_permille},
    {"soh_permille", &SecondPack::Values::soh_permille},
    {"cell_temperature_min_dC", &SecondPack::Values::cell_temperature_min_dC},
    {"cell_temperature_max_dC", &SecondPack::Values::cell_temperature_max_dC},
};

constexpr bool is_printable(std::uint8_t byte) {
  return byte >= ' ' && byte <= '~';
}

}  // namespace

bool SecondPack::observe(const CanFrame& frame, TimePoint at) {
  if (!is_expected() || frame.is_error || frame.is_extended || frame.id - config_.base_id >= message_count)
    return false;
  const std::uint32_t index = frame.id - config_.base_id;
  const MessageSpec& message = *row_of(config_.dialect).catalogue->messages()[index];
  const bool has_grown = index == status_index || index == charge_index;
  const bool has_length = frame.length == message.length || (has_grown && frame.length == old_length);
  const bool is_taken = has_length && !frame.is_remote && take(message, frame, at);
  ++(is_taken ? frames_taken_ : frames_refused_);
  if (is_taken) heard_at_ = at;
  return true;
}

bool SecondPack::take(const MessageSpec& message, const CanFrame& frame, TimePoint at) {
  const std::uint32_t index = frame.id - config_.base_id;
  if (index == name_index) return take_name(frame);
  const bool has_state_bits = index == status_index && message.signals.front().name != state_name;
  if (has_state_bits) take_value(values_.state, known(frame.data[0]), at);
  for (const SignalSpec& signal : message.signals) {
    const auto* const row = std::find_if(std::begin(value_rows), std::end(value_rows),
                                         [&](const ValueRow& one) { return one.signal == signal.name; });
    if (row == std::end(value_rows)) continue;
    const bool is_behind = signal.first_bit >= frame.length * 8U;
    take_value(values_.*row->value, is_behind ? not_known() : decode_signal(signal, frame.data), at);
  }
  return true;
}

void SecondPack::take_value(Measured<std::int32_t>& target, const SignalValue& value, TimePoint at) {
  target = measured(value, at);
  if (value.validity == Validity::out_of_range) ++values_out_of_range_;
}

bool SecondPack::take_name(const CanFrame& frame) {
  if (!std::all_of(frame.data.begin(), frame.data.end(), is_printable)) return false;
  std::transform(frame.data.begin(), frame.data.end(), values_.name.begin(),
                 [](std::uint8_t byte) { return static_cast<char>(byte); });
  return true;
}

std::optional<std::int32_t> SecondPack::soc_permille(TimePoint now) const {
  const Measured<std::int32_t>& soc = values_.soc_permille;
  return soc.is_usable(now, age_max) ? std::optional(soc.value) : std::nullopt;
}

}  // namespace bmu
