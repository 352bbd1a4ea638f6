#include "mmu/devices/pdu.hpp"

#include <algorithm>
#include <array>

namespace bmu {

namespace {

/// One row per state, in the order of ir155::State.
constexpr std::array<InsulationMonitor, 9> told_states{
    InsulationMonitor::no_signal,    InsulationMonitor::no_signal,   InsulationMonitor::normal,
    InsulationMonitor::undervoltage, InsulationMonitor::speed_start, InsulationMonitor::speed_start,
    InsulationMonitor::device_error, InsulationMonitor::earth_fault, InsulationMonitor::no_signal};

bool has_contactor(const PduOutputs& outputs) {
  const ContactorFlags& driven = outputs.contactors;
  return std::any_of(driven.begin(), driven.end(), [](bool is_driven) { return is_driven; });
}

}  // namespace

InsulationMonitor told_state(ir155::State state) {
  return told_states[static_cast<std::size_t>(state)];
}

void Pdu::observe(const CanFrame& frame, TimePoint now) {
  if (frame.id != internal_bus::contactor_command.base_id) return;
  if (!check_.check(frame).is_accepted) return;
  using internal_bus::contactor_command;
  outputs_ = {.contactors = {read_raw<contactor_command, "main_positive">(frame) != 0,
                             read_raw<contactor_command, "main_negative">(frame) != 0,
                             read_raw<contactor_command, "precharge">(frame) != 0,
                             read_raw<contactor_command, "charge">(frame) != 0},
              .auxiliary = read_raw<contactor_command, "auxiliary">(frame) != 0,
              .fan = read_raw<contactor_command, "fan">(frame) != 0,
              .heater = read_raw<contactor_command, "heater">(frame) != 0};
  expires_at_ = now + internal_bus::contactor_command_life;
  const bool is_to_close = has_contactor(outputs_);
  if (!is_to_close && !is_loop_open_) is_disabled_ = false;
  opened_by_timeout_ = is_disabled_ && is_to_close;
  if (is_disabled_) disable_outputs();
  ++counts_.commands;
}

PduFrames Pdu::tick(TimePoint now, const PduMeasurements& measured) {
  open_if_expired(now);
  open_if_alarmed(measured.alarm_loop_open);
  const ir155::Reading insulation = ir155::decode(measured.insulation);
  const Told current{.feedback = measured.feedback,
                     .outputs = outputs_,
                     .inputs = measured.inputs,
                     .insulation_monitor = told_state(insulation.state),
                     .opened_by_timeout = opened_by_timeout_,
                     .alarm_loop_open = is_loop_open_};
  PduFrames out;
  const bool is_periodic = periodic_.take(now);
  if (is_periodic || current != told_) {
    told_ = current;
    out.push_back(make_status(measured, insulation));
  }
  const bool has_sensor = measured.intake_air_dC.validity != Validity::not_fitted;
  if (temperatures_.take(now) && has_sensor) out.push_back(make_temperature(measured.intake_air_dC));
  return out;
}

CanFrame Pdu::make_temperature(const SignalValue& intake_air_dC) {
  using internal_bus::pdu_temperature;
  CanFrame frame = make_frame(pdu_temperature);
  write<pdu_temperature, "intake_air_temperature_dC">(frame, intake_air_dC);
  seal(pdu_temperature, temperature_counter_++, frame);
  return frame;
}

/// Without a driven output there is nothing to open: an idle PDU without a master reports no timeout.
void Pdu::open_if_expired(TimePoint now) {
  if (!outputs_.any() || now < expires_at_) return;
  outputs_ = {};
  opened_by_timeout_ = true;
  ++counts_.timeouts;
}

void Pdu::open_if_alarmed(bool is_loop_open) {
  is_loop_open_ = is_loop_open;
  if (!is_loop_open) return;
  if (has_contactor(outputs_)) {
    opened_by_timeout_ = true;
    ++counts_.alarms;
  }
  is_disabled_ = true;
  disable_outputs();
}

void Pdu::disable_outputs() {
  outputs_ = {.fan = outputs_.fan};
}

CanFrame Pdu::make_status(const PduMeasurements& measured, const ir155::Reading& insulation) {
  using internal_bus::pdu_status;
  const PduInputs& inputs = measured.inputs;
  CanFrame frame = make_frame(pdu_status);
  write<pdu_status, "opened_by_timeout">(frame, opened_by_timeout_);
  write<pdu_status, "alarm_loop_open">(frame, is_loop_open_);
  write<pdu_status, "heater_on">(frame, outputs_.heater);
  write<pdu_status, "fan_on">(frame, outputs_.fan);
  write<pdu_status, "auxiliary_on">(frame, outputs_.auxiliary);
  write<pdu_status, "charge_closed">(frame, measured.feedback[3]);
  write<pdu_status, "precharge_closed">(frame, measured.feedback[2]);
  write<pdu_status, "main_negative_closed">(frame, measured.feedback[1]);
  write<pdu_status, "main_positive_closed">(frame, measured.feedback[0]);
  write<pdu_status, "resume_button">(frame, inputs.resume_button);
  write<pdu_status, "insulation_monitor_ok">(frame, inputs.insulation_monitor_ok);
  write<pdu_status, "interlock_closed">(frame, inputs.interlock_closed);
  write<pdu_status, "estop_2_released">(frame, inputs.estop_2_released);
  write<pdu_status, "estop_1_released">(frame, inputs.estop_1_released);
  write<pdu_status, "charger_connected">(frame, inputs.charger_connected);
  write<pdu_status, "vehicle_on">(frame, inputs.vehicle_on);
  write<pdu_status, "insulation_resistance_Ohm">(frame, insulation.resistance_Ohm);
  write<pdu_status, "insulation_monitor_state">(frame, static_cast<std::int64_t>(told_state(insulation.state)));
  write<pdu_status, "throttle_permille">(frame, measured.throttle_permille);
  seal(pdu_status, counter_++, frame);
  return frame;
}

}  // namespace bmu
