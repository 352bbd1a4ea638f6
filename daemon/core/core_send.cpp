// Stages of the core that send frames, each through the output gate.
#include <algorithm>
#include <optional>
#include <span>

#include "daemon/core/core.hpp"

namespace bmu {

/// The claim permits the port, and the bus that it shares with the modules transmits; for a bus of its own this is
/// unknown.
bool Core::has_way(Port port, TimePoint now) const {
  return claim_.may_send(port, now) && (!serves(config_, Port::internal, port) || !command_link_.is_stuck(now));
}

/// Reads the settings of the sensor, and corrects them if the pack file requires it.
void Core::ask_sensor(SensorSetup& setup, TimePoint now, Decisions& out) {
  if (!setup.is_there() || !flags_.internal_bus_up || asks_nobody()) return;
  const SensorSetup before = setup;
  const std::optional<CanFrame> command = setup.step(now, outputs_.any_contactor());
  note_sensor_setup(before, setup, now);
  if (command) send(Port::internal, *command, out);
}

/// A pack asleep needs no command: it is open, and the PDU keeps it open by itself.
void Core::send_contactor_command(TimePoint now, Decisions& out) {
  if (!config_.contactors.has_pdu || (rest_.is_resting() && !outputs_.any_contactor())) return;
  if (!claim_.may_command()) return;
  if (!command_link_.is_due(now, outputs_changed_at_ == now)) return;
  command_link_.note_sent(command_counter_, now);
  send(Port::internal, contactor_command_frame(outputs_, command_counter_), out);
  ++command_counter_;
}

void Core::send_report(TimePoint now, Decisions& out) {
  if (rest_.is_resting() || !has_way(Port::vehicle, now) || !reporter_.is_due(now)) return;
  const std::optional<CanFrame> frame = reporter_.step(now, vehicle_view(now), config_.vehicle);
  if (frame.has_value()) send(Port::vehicle, *frame, out);
}

void Core::send_cell_data(TimePoint now, Decisions& out) {
  if (rest_.is_resting() || !has_way(Port::vehicle, now) || !cell_reporter_.is_due(now)) return;
  const std::optional<CanFrame> frame = cell_reporter_.step(now, modules_, config_);
  if (frame.has_value()) send(Port::vehicle, *frame, out);
}

/// Also sent while the pack is open: an inverter without messages may act on its own.
void Core::tell_inverter(TimePoint now, Decisions& out) {
  if (!inverter_reporter_.is_there()) return;
  const InverterView view = inverter_view(now);
  inverter_reporter_.follow(view);
  keep_hours_since_full(view.now);
  if (rest_.is_resting() || !has_way(Port::inverter, now)) return;
  const std::optional<CanFrame> frame = inverter_reporter_.step(view);
  if (frame && !send(Port::inverter, *frame, out)) inverter_reporter_.note_failed(*frame);
}

void Core::answer_request(TimePoint now, Decisions& out) {
  if (!requests_.is_waiting() || !has_way(Port::vehicle, now)) return;
  const VehicleView vehicle = vehicle_view(now);
  const std::optional<CanFrame> answer =
      requests_.step({.now = now, .config = &config_, .modules = &modules_, .vehicle = &vehicle});
  if (answer) send(Port::vehicle, *answer, out);
}

/// Computed from the present state and not read from the frame to be sent; in any case at most the pack's own limits.
InverterLimits Core::inverter_bounds() const {
  if (!inverter_reporter_.is_there()) return {};
  const InverterLimits decided = inverter_limits(inverter_view(decided_at_), config_.inverter);
  return {.charge_mA = permission_.may_charge ? std::min(decided.charge_mA, limits_.charge.limit_mA) : 0,
          .discharge_mA = permission_.may_discharge ? std::min(decided.discharge_mA, limits_.discharge.limit_mA) : 0};
}

GateRules Core::gate_rules() const {
  const InverterLimits inverter = inverter_bounds();
  return {.vehicle_base_id = config_.vehicle.base_id,
          .dialect = config_.vehicle.dialect,
          .reply_id = config_.vehicle.request_id != 0 ? std::optional(reply_id_of(config_.vehicle)) : std::nullopt,
          .cell_voltages_id = config_.vehicle.cell_voltages_id,
          .cell_temperatures_id = config_.vehicle.cell_temperatures_id,
          .sensor = config_.sensor.set_up,
          .may_configure_sensor = config_.sensor.is_configured && !outputs_.any_contactor(),
          .may_store_in_sensor = config_.sensor.is_configured && config_.sensor.is_stored,
          .second_sensor_command_id = config_.sensor.second_command_id,
          .charger = config_.charger.driver,
          .master_address = config_.charger.master_address,
          .may_charge = permission_.may_charge && charge_.is_enabled(),
          .may_request_mains = may_request_mains(),
          .charge_current_mA = charge_.current_mA(),
          .ordered_mA = std::span(ordered_mA_).first(chargers_.unit_count()),
          .charge_voltage_mV = charge_.voltage_mV(),
          .inverter = config_.inverter.driver,
          .inverter_charge_mA = inverter.charge_mA,
          .inverter_discharge_mA = inverter.discharge_mA,
          .inverter_charge_voltage_mV = config_.inverter.charge_voltage_max_mV,
          .inverter_discharge_voltage_mV = config_.inverter.discharge_voltage_min_mV,
          .is_soc_known = soc_permille().has_value(),
          .modules = config_.foreign.driver,
          .module_options = config_.foreign.options,
          .module_round = rounds_.count(),
          .bleed_above_uV = bleed_above_uV(),
          .may_stay_closed = permission_.may_stay_closed,
          .decided = outputs_};
}

/// Sends nothing before the claim, nor after its loss.
bool Core::send(Port port, const CanFrame& frame, Decisions& out) {
  if (!claim_.may_send(port, decided_at_)) return false;
  if (judge_output(port, frame, gate_rules()) != GateVerdict::pass) {
    ++gate_refusals_;
    events_.push({.id = EventId::gate_refused, .at = decided_at_, .port = port, .number = frame.id});
    return false;
  }
  if (!ports_[static_cast<std::size_t>(port)].is_up) return false;
  ++ports_[static_cast<std::size_t>(port)].frames_sent;
  out.frames.push_back({port, frame});
  return true;
}

}  // namespace bmu
