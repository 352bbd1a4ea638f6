#include "daemon/core/sensor_table.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

std::string_view to_text(InsulationState state) {
  switch (state) {
    case InsulationState::no_signal: return "no signal";
    case InsulationState::normal: return "normal";
    case InsulationState::undervoltage: return "undervoltage";
    case InsulationState::speed_start: return "speed start";
    case InsulationState::device_error: return "device error";
    case InsulationState::earth_fault: return "earth fault";
    case InsulationState::undefined: return "undefined";
  }
  return "?";
}

namespace {

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

/// The value is the first signal of every sensor row, so that both byte orders read alike.
Measured<std::int32_t> sensor_value(const MessageSpec& message, const CanFrame& frame, TimePoint at) {
  Measured<std::int32_t> value = measured(decode_signal(message.signals[0], frame.data), at);
  const bool is_wrong =
      read_raw<sensor_current, "measurement_error">(frame) != 0 || read_raw<sensor_current, "system_error">(frame) != 0;
  if (is_wrong) value.validity = Validity::sensor_fault;
  return value;
}

bool take(const Measured<std::int32_t>& sample, Measured<std::int32_t>& slot, RefusedResult& refused) {
  if (sample.is_valid()) {
    slot = sample;
  } else {
    refused = {sample.validity, sample.taken_at, refused.count + 1};
  }
  return sample.is_valid();
}

/// A contact of which both tell is closed if either says so: an open pack whose contact may be closed is never open.
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
    input = is_permission ? input && line : input || line;  // a "no" of either holds; a wish of either counts
  }
}

}  // namespace

Measured<PduState> merge_inputs(const Measured<PduState>& unit, const Measured<LineImage>& lines,
                                const CoreConfig& config) {
  const LinesConfig& used = config.lines;
  const bool has_unit = config.contactors.has_pdu;
  if (!used.are_used) return unit;
  if (!lines.is_valid() || (has_unit && !unit.is_valid())) return {};
  // Without a unit there is nobody to say what has no line: such stops and loops do not exist.
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
    case sensor_current.base_id: {
      const Measured<std::int32_t> sample = sensor_value(message, frame, at);
      if (!take(sample, current_mA, refused)) break;
      if (config.sensor.invert_current) current_mA.value = -current_mA.value;
      current_window.add(current_mA.value, at);
      break;
    }
    case sensor_current_2.base_id:
      if (!take(sensor_value(message, frame, at), current_2_mA, refused)) break;
      if (config.sensor.invert_current) current_2_mA.value = -current_2_mA.value;
      break;
    case sensor_u1.base_id: take(sensor_value(message, frame, at), pack_voltage_mV, refused); break;
    case sensor_u2.base_id: take(sensor_value(message, frame, at), link_voltage_mV, refused); break;
    case pdu_status.base_id:
      pdu_word = {pdu_state(frame), at, Validity::valid};
      if (knows_insulation(pdu_word.value)) {
        insulation_known_at = at;
        insulation_told = true;
      }
      pdu = merge_inputs(pdu_word, lines, config);
      break;
    default: break;  // the sensor's own counters are taken as a second opinion by a later stage
  }
}

void SensorTable::observe(const LineImage& image, TimePoint at, const CoreConfig& config) {
  lines = {image, at, image.is_failed ? Validity::sensor_fault : Validity::valid};
  pdu = merge_inputs(pdu_word, lines, config);
}

}  // namespace bmu
