#include "daemon/core/measurement/sensor_table.hpp"

#include <algorithm>
#include <limits>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// Limits of the temperature of cooling air: a value beyond these is from a defective sensor.
constexpr std::int32_t air_temperature_min_dC = -600;
constexpr std::int32_t air_temperature_max_dC = 1'200;

using namespace internal_bus;

InsulationState insulation_state(std::int64_t raw) {
  return raw <= 5 ? static_cast<InsulationState>(raw) : InsulationState::undefined;
}

PduState pdu_state(const CanFrame& frame) {
  return {
      .main_positive_closed = read_raw<pdu_status, "main_positive_closed">(frame) != 0,
      .main_negative_closed = read_raw<pdu_status, "main_negative_closed">(frame) != 0,
      .precharge_closed = read_raw<pdu_status, "precharge_closed">(frame) != 0,
      .charge_closed = read_raw<pdu_status, "charge_closed">(frame) != 0,
      .opened_by_timeout = read_raw<pdu_status, "opened_by_timeout">(frame) != 0,
      .alarm_loop_open = read_raw<pdu_status, "alarm_loop_open">(frame) != 0,
      .vehicle_on = read_raw<pdu_status, "vehicle_on">(frame) != 0,
      .charger_connected = read_raw<pdu_status, "charger_connected">(frame) != 0,
      .estop_1_released = read_raw<pdu_status, "estop_1_released">(frame) != 0,
      .estop_2_released = read_raw<pdu_status, "estop_2_released">(frame) != 0,
      .interlock_closed = read_raw<pdu_status, "interlock_closed">(frame) != 0,
      .insulation_monitor_ok = read_raw<pdu_status, "insulation_monitor_ok">(frame) != 0,
      .resume_button = read_raw<pdu_status, "resume_button">(frame) != 0,
      .insulation_state = insulation_state(read_raw<pdu_status, "insulation_monitor_state">(frame)),
      .insulation_resistance_Ohm = read<pdu_status, "insulation_resistance_Ohm">(frame),
      .throttle_permille = read<pdu_status, "throttle_permille">(frame),
  };
}

/// Each of the four error bits of a result makes its value invalid: a sensor that flags any of its results, or an
/// overcurrent, gives no measurement.
bool has_error_bit(const CanFrame& frame) {
  return read_raw<sensor_current, "measurement_error">(frame) != 0 ||
         read_raw<sensor_current, "any_measurement_error">(frame) != 0 ||
         read_raw<sensor_current, "system_error">(frame) != 0 || read_raw<sensor_current, "overcurrent">(frame) != 0;
}

/// The value is the first signal of every sensor row, so that both byte orders read alike.
Measured<std::int32_t> sensor_value(const MessageSpec& message, const CanFrame& frame, TimePoint at) {
  Measured<std::int32_t> value = measured(decode_signal(message.signals[0], frame.data), at);
  if (has_error_bit(frame)) value.validity = Validity::sensor_fault;
  return value;
}

bool take(const Measured<std::int32_t>& sample, Measured<std::int32_t>& slot, RefusedResults& refused) {
  if (sample.is_valid()) {
    slot = sample;
  } else {
    refused.note(refusal_of(sample.validity), sample.taken_at);
  }
  return sample.is_valid();
}

/// A contact with two sources is closed if either reports closed: a pack with a possibly closed contact is never open.
void merge_contact(bool& contact, ContactorId id, const LineImage& image, const LinesConfig& config, bool has_unit) {
  const auto bit = static_cast<std::uint8_t>(1U << static_cast<unsigned>(id));
  if ((config.feedback & bit) == 0) return;
  const bool is_closed = (image.closed_contacts & bit) != 0;
  contact = has_unit ? contact || is_closed : is_closed;
}

void merge_input(bool& input, bool has_line, bool line, bool has_unit, bool is_permission) {
  if (!has_line) return;
  if (!has_unit) {
    input = line;
  } else {
    input = is_permission ? input && line : input || line;  // a permission needs both sources, a request only one
  }
}

/// Stores the state of a monitor that the daemon reads directly, instead of that of the PDU, combined with the OK line
/// of this host.
void put_insulation(PduState& inputs, const InsulationWord& word, const LineImage& lines, const CoreConfig& config) {
  inputs.insulation_state = word.state;
  inputs.insulation_resistance_Ohm = word.resistance_Ohm;
  inputs.insulation_monitor_ok = word.is_ok && (!config.lines.has_insulation_ok || lines.insulation_ok);
}

/// Inverts the sign of a current. The minimum of its type becomes the maximum.
void turn_round(Measured<std::int32_t>& current_mA) {
  constexpr std::int32_t most_mA = std::numeric_limits<std::int32_t>::max();
  current_mA.value = -std::max(current_mA.value, -most_mA);
}

}  // namespace

Measured<PduState> merge_inputs(const Measured<PduState>& unit, const Measured<LineImage>& lines,
                                const CoreConfig& config) {
  const LinesConfig& used = config.lines;
  const bool has_unit = config.contactors.has_pdu;
  if (!used.are_used) return unit;
  if (!lines.is_valid() || (has_unit && !unit.is_valid())) return {};
  // Without a PDU, stops and loops without a GPIO line do not exist.
  Measured<PduState> merged = unit;
  if (!has_unit) {
    merged.value = {
        .estop_1_released = true, .estop_2_released = true, .interlock_closed = true, .insulation_monitor_ok = true};
  }
  PduState& state = merged.value;
  const LineImage& image = lines.value;
  merge_contact(state.main_positive_closed, ContactorId::main_positive, image, used, has_unit);
  merge_contact(state.main_negative_closed, ContactorId::main_negative, image, used, has_unit);
  merge_contact(state.precharge_closed, ContactorId::precharge, image, used, has_unit);
  merge_contact(state.charge_closed, ContactorId::charge, image, used, has_unit);
  merge_input(state.vehicle_on, used.has_vehicle_on, image.vehicle_on, has_unit, false);
  merge_input(state.charger_connected, used.has_charger_connected, image.charger_connected, has_unit, false);
  merge_input(state.resume_button, used.has_resume_button, image.resume_button, has_unit, false);
  merge_input(state.insulation_monitor_ok, used.has_insulation_ok, image.insulation_ok, has_unit, true);
  merge_input(state.supply_ok, used.has_supply_ok, image.supply_ok, has_unit, true);
  state.estops_pressed = image.estops_pressed;
  state.interlocks_open = image.interlocks_open;
  merged.taken_at = has_unit ? std::min(unit.taken_at, lines.taken_at) : lines.taken_at;
  merged.validity = Validity::valid;
  return merged;
}

void SensorTable::observe(const MessageSpec& message, const CanFrame& frame, TimePoint at, const CoreConfig& config) {
  switch (message.base_id) {
    case sensor_current.base_id:
      // If `first` is set this is the second current, unless `second` is set, too.
      if (config.sensor.first != nullptr && config.sensor.second != nullptr) break;
      take_current(sensor_value(message, frame, at), config.sensor.first == nullptr, config.sensor);
      break;
    case sensor_current_2.base_id:
      if (config.sensor.first != nullptr || config.sensor.second != nullptr) break;
      take_current(sensor_value(message, frame, at), false, config.sensor);
      break;
    case sensor_u1.base_id: {
      const Measured<std::int32_t> before = pack_voltage_mV;
      if (take(sensor_value(message, frame, at), pack_voltage_mV, refused)) pack_voltage_before_mV = before;
      break;
    }
    case sensor_u2.base_id: take(sensor_value(message, frame, at), link_voltage_mV, refused); break;
    case pdu_status.base_id:
      pdu_word = {pdu_state(frame), at, Validity::valid};
      if (!config.insulation.is_heard_itself() && knows_insulation(pdu_word.value)) {
        insulation_known_at = at;
        insulation_told = true;
      }
      merge(config);
      break;
    case pdu_temperature.base_id:
      if (config.intake_air.source != AirSource::pdu) break;
      intake_air_dC = measured(read<pdu_temperature, "intake_air_temperature_dC">(frame), at);
      break;
    default: break;  // the counters of the sensor itself are not used
  }
}

void SensorTable::observe_intake_air(std::int32_t temperature_dC, TimePoint at, const CoreConfig& config) {
  if (config.intake_air.source != AirSource::file) return;
  const bool is_possible = temperature_dC >= air_temperature_min_dC && temperature_dC <= air_temperature_max_dC;
  intake_air_dC = {temperature_dC, at, is_possible ? Validity::valid : Validity::out_of_range};
}

void SensorTable::observe(const LineImage& image, TimePoint at, const CoreConfig& config) {
  lines = {image, at, image.is_failed ? Validity::sensor_fault : Validity::valid};
  merge(config);
}

void SensorTable::merge(const CoreConfig& config) {
  pdu = merge_inputs(pdu_word, lines, config);
  if (config.insulation.is_heard_itself()) put_insulation(pdu.value, insulation, lines.value, config);
}

void SensorTable::take_current(const Measured<std::int32_t>& sample, bool is_first, const SensorConfig& config) {
  Measured<std::int32_t>& slot = is_first ? current_mA : current_2_mA;
  if (!take(sample, slot, refused)) return;
  if (config.invert_current != (!is_first && config.is_second_reversed)) turn_round(slot);
  if (is_first) current_window.add(current_mA.value, sample.taken_at);
}

void SensorTable::observe_current(const SignalValue& told_mA, bool is_first, TimePoint at, const CoreConfig& config) {
  take_current(measured(told_mA, at), is_first, config.sensor);
}

void SensorTable::take_insulation(const InsulationWord& word, const CoreConfig& config) {
  if (!config.insulation.is_heard_itself()) return;
  insulation = word;
  if (word.taken_at != TimePoint{}) {
    insulation_known_at = word.taken_at;
    insulation_told = true;
  }
  merge(config);
}

}  // namespace bmu
