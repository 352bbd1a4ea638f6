#include "mmu/devices/can_second_pack.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "protocol/message.hpp"
#include "protocol/row_order.hpp"
#include "protocol/tables/vehicle_dialects.hpp"

namespace bmu {

namespace {

constexpr std::size_t message_count = std::size(vehicle_bus::rows);
constexpr std::size_t name_index = 0;
constexpr std::size_t version_index = 1;
constexpr std::string_view name = "SECOND  ";
constexpr std::string_view version = "EMULATED";
static_assert(name.size() == 8 && version.size() == 8);

/// Encoding of a state in each dialect: a number in the first two, bits in `elithion`.
struct StateRow {
  SecondPackState state;
  std::uint8_t iha;
  std::uint8_t original;  // it has no number for a fault: the vehicle is on and the contactors are open
  bool has_fault;
  bool is_closed;
  bool vehicle_on;
  bool charger_connected;
};
constexpr std::array<StateRow, second_pack_state_count> states{{
    {SecondPackState::fault, 0, 2, true, false, false, false},
    {SecondPackState::open, 4, 0, false, false, false, false},
    {SecondPackState::closed, 3, 0, false, true, false, false},
    {SecondPackState::driving, 2, 4, false, true, true, false},
    {SecondPackState::charging, 1, 10, false, true, false, true},
}};
static_assert(rows_are_in_order(states, &StateRow::state));

/// Inputs of all signals.
struct Telling {
  const CanSecondPack& pack;
  const StateRow& state;
  Duration uptime;
  double pack_mV;
  double cell_uV;
};

SignalValue flag(bool is_set) {
  return known(is_set ? 1 : 0);
}
SignalValue rounded(double value) {
  return known(std::llround(value));
}
SignalValue uptime_s(const Telling& told) {
  constexpr std::int64_t field = 65'536;
  return known(std::chrono::duration_cast<std::chrono::seconds>(told.uptime).count() % field);
}
SignalValue limit(const Telling& told) {
  return told.state.is_closed ? not_known() : known(0);
}

/// Below this a current is "neither charging nor discharging".
constexpr double flowing_A = 0.2;

/// Value of a signal. The names are the same in all dialects.
struct ValueRow {
  std::string_view signal;
  SignalValue (*value)(const Telling&);
};
constexpr ValueRow value_rows[] = {
    {"uptime_s", uptime_s},
    {"discharging", [](const Telling& told) { return flag(told.pack.current_A >= flowing_A); }},
    {"charging", [](const Telling& told) { return flag(told.pack.current_A <= -flowing_A); }},
    {"fault", [](const Telling& told) { return flag(told.state.has_fault); }},
    {"k1_on", [](const Telling& told) { return flag(told.state.is_closed); }},
    {"k3_on", [](const Telling& told) { return flag(told.state.is_closed); }},
    {"source_power", [](const Telling& told) { return flag(told.state.charger_connected); }},
    {"load_power", [](const Telling& told) { return flag(told.state.vehicle_on); }},
    {"charging_blocked", [](const Telling& told) { return flag(!told.state.is_closed); }},
    {"discharging_blocked", [](const Telling& told) { return flag(!told.state.is_closed); }},
    {"pack_voltage_mV", [](const Telling& told) { return rounded(told.pack_mV); }},
    {"cell_voltage_min_uV", [](const Telling& told) { return rounded(told.cell_uV); }},
    {"cell_voltage_max_uV", [](const Telling& told) { return rounded(told.cell_uV); }},
    {"pack_current_mA", [](const Telling& told) { return rounded(told.pack.current_A * 1e3); }},
    {"charge_limit_mA", limit},
    {"discharge_limit_mA", limit},
    {"soc_permille",
     [](const Telling& told) { return told.pack.knows_soc ? rounded(told.pack.soc_permille) : not_known(); }},
    {"cell_temperature_average_dC", [](const Telling& told) { return rounded(told.pack.temperature_dC); }},
    {"cell_temperature_min_dC", [](const Telling& told) { return rounded(told.pack.temperature_dC); }},
    {"cell_temperature_max_dC", [](const Telling& told) { return rounded(told.pack.temperature_dC); }},
};

SignalValue state_number(VehicleDialect dialect, const StateRow& state) {
  return known(dialect == VehicleDialect::iha ? state.iha : state.original);
}

/// Unknown; 0 (none) for signals without such a code: trouble codes and flags.
SignalValue without_row(const SignalSpec& signal) {
  return signal.special.empty() ? known(0) : not_known();
}

SignalValue value_of(const SignalSpec& signal, const Telling& told) {
  if (signal.name == "state") return state_number(told.pack.config().dialect, told.state);
  const auto* const row = std::find_if(std::begin(value_rows), std::end(value_rows),
                                       [&signal](const ValueRow& one) { return one.signal == signal.name; });
  return row == std::end(value_rows) ? without_row(signal) : row->value(told);
}

}  // namespace

std::optional<CanFrame> CanSecondPack::tick(TimePoint now, double rest_mV) {
  if (!is_there() || now < due_at_) return std::nullopt;
  const std::size_t index = next_;
  next_ = (next_ + 1) % message_count;
  due_at_ += next_ == 0 ? period - spacing * (static_cast<int>(message_count) - 1) : spacing;
  if (is_silent) return std::nullopt;
  return message(index, now, voltage_mV.value_or(rest_mV));
}

CanFrame CanSecondPack::message(std::size_t index, TimePoint now, double pack_mV) const {
  const MessageSpec& row = *row_of(config_.dialect).catalogue->messages()[index];
  CanFrame frame = make_frame(row);
  frame.id = frame.id - vehicle_bus::default_base_id + config_.base_id;
  if (index == name_index || index == version_index) {
    const std::string_view text = index == name_index ? name : version;
    std::copy(text.begin(), text.end(), frame.data.begin());
    return frame;
  }
  const Telling told{.pack = *this,
                     .state = states[static_cast<std::size_t>(state)],
                     .uptime = now - started_at_,
                     .pack_mV = pack_mV,
                     .cell_uV = pack_mV * 1e3 / static_cast<double>(cell_count_)};
  for (const SignalSpec& signal : row.signals) encode_signal(signal, value_of(signal, told), frame.data);
  return frame;
}

}  // namespace bmu
