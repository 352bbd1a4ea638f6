#include "daemon/core/sensor_table.hpp"

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

}  // namespace

void SensorTable::observe(const MessageSpec& message, const CanFrame& frame, TimePoint at, const SensorConfig& config) {
  switch (message.base_id) {
    case sensor_current.base_id: {
      const Measured<std::int32_t> sample = sensor_value(message, frame, at);
      if (!take(sample, current_mA, refused)) break;
      if (config.invert_current) current_mA.value = -current_mA.value;
      current_window.add(current_mA.value, at);
      break;
    }
    case sensor_u1.base_id: take(sensor_value(message, frame, at), pack_voltage_mV, refused); break;
    case sensor_u2.base_id: take(sensor_value(message, frame, at), link_voltage_mV, refused); break;
    case pdu_status.base_id:
      pdu = {pdu_state(frame), at, Validity::valid};
      if (knows_insulation(pdu.value)) insulation_known_at = at;
      break;
    default: break;  // the sensor's own counters are taken as a second opinion by a later stage
  }
}

}  // namespace bmu
