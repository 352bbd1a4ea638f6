#include "daemon/core/contactors/output_gate.hpp"

#include "devices/cell_data/cell_data.hpp"
#include "protocol/message.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

std::string_view to_text(GateVerdict verdict) {
  switch (verdict) {
    case GateVerdict::pass: return "pass";
    case GateVerdict::not_ours: return "not a frame of this node";
    case GateVerdict::malformed: return "malformed";
    case GateVerdict::not_permitted: return "not permitted";
  }
  return "?";
}

namespace {

using internal_bus::contactor_command;

MessageMatch find_row(Port port, const CanFrame& frame, const GateRules& rules) {
  if (port == Port::internal) {
    return (rules.modules == nullptr ? internal_bus::catalogue : internal_bus::catalogue_without_modules)
        .find(frame.id);
  }
  if (port != Port::vehicle) return {};  // receive only
  // The vehicle rows have their default identifiers; the configured base shifts them.
  return row_of(rules.dialect).catalogue->find(frame.id - rules.vehicle_base_id + vehicle_bus::default_base_id);
}

/// The row of the cyclic cell data with this identifier; null: none.
const MessageSpec* cell_data_row(const CanFrame& frame, const GateRules& rules) {
  if (frame.id == 0) return nullptr;
  if (frame.id == rules.cell_voltages_id) return &cell_data::voltages;
  return frame.id == rules.cell_temperatures_id ? &cell_data::temperatures : nullptr;
}

bool is_well_formed(const MessageSpec& row, const CanFrame& frame) {
  if (frame.is_extended || frame.is_remote || frame.is_error || frame.length != row.length) return false;
  if (has_crc(row) && frame.data[7] != frame_crc(frame)) return false;
  return row.protection != Protection::counter_crc_complement || (frame.data[0] ^ frame.data[1]) == 0xFF;
}

GateVerdict judge_charger(const CanFrame& frame, const GateRules& rules) {
  if (rules.charger == nullptr) return GateVerdict::not_ours;
  const std::optional<ChargerCommand> command = rules.charger->order_of(frame);
  if (!command) return GateVerdict::not_ours;
  const ChargerOrder& order = command->order;
  const bool is_ours = command->unit < rules.ordered_mA.size() && order.master_address == rules.master_address;
  if (!is_ours) return GateVerdict::not_ours;
  if (order.requests_mains && !rules.may_request_mains) return GateVerdict::not_permitted;
  if (!order.is_enabled) return GateVerdict::pass;
  std::int64_t together_mA = order.current_mA;
  for (std::size_t unit = 0; unit < rules.ordered_mA.size(); ++unit) {
    if (unit != command->unit) together_mA += rules.ordered_mA[unit];
  }
  // Less than before is never too much, even if the other units have not received their commands yet.
  const bool is_less = order.current_mA <= rules.ordered_mA[command->unit];
  const bool is_bounded =
      (is_less || together_mA <= rules.charge_current_mA) && order.voltage_mV <= rules.charge_voltage_mV;
  return rules.may_charge && is_bounded ? GateVerdict::pass : GateVerdict::not_permitted;
}

/// A field that is not in the frame counts as not permitted by it.
GateVerdict judge_inverter(const CanFrame& frame, const GateRules& rules) {
  if (rules.inverter == nullptr) return GateVerdict::not_ours;
  BatteryReport told{.discharge_voltage_limit_mV = rules.inverter_discharge_voltage_mV};
  const BatteryWord word = rules.inverter->hear(frame, told);
  if (word == BatteryWord::none) return GateVerdict::not_ours;
  if (word == BatteryWord::refused) return GateVerdict::malformed;
  const bool may_charge = rules.inverter_charge_mA > 0;
  const bool may_discharge = rules.inverter_discharge_mA > 0;
  const bool is_current_bounded =
      told.charge_limit_mA <= rules.inverter_charge_mA && told.discharge_limit_mA <= rules.inverter_discharge_mA;
  const bool is_voltage_bounded = told.charge_voltage_limit_mV <= rules.inverter_charge_voltage_mV &&
                                  told.discharge_voltage_limit_mV >= rules.inverter_discharge_voltage_mV;
  const bool asks_for_charge = told.asks_for_charge || told.asks_for_full_charge;
  const bool may_ask = may_charge && rules.is_soc_known;
  const bool is_allowed =
      (may_charge || !told.may_charge) && (may_discharge || !told.may_discharge) && (may_ask || !asks_for_charge);
  return is_current_bounded && is_voltage_bounded && is_allowed ? GateVerdict::pass : GateVerdict::not_permitted;
}

GateVerdict judge_sensor(const SetUpOrder& order, const GateRules& rules) {
  switch (order.kind) {
    case SetUpOrderKind::read:
    case SetUpOrderKind::run: return GateVerdict::pass;
    case SetUpOrderKind::stop:
    case SetUpOrderKind::set: return rules.may_configure_sensor ? GateVerdict::pass : GateVerdict::not_permitted;
    case SetUpOrderKind::store: break;
  }
  return rules.may_store_in_sensor ? GateVerdict::pass : GateVerdict::not_permitted;
}

/// The settings of a second sensor are only read; it is sent no other command.
GateVerdict judge_second_sensor(const CanFrame& frame, const GateRules& rules) {
  CanFrame as_delivered = frame;
  as_delivered.id = rules.sensor->command_id;
  const std::optional<SetUpOrder> order = rules.sensor->order_of(as_delivered);
  if (!order) return GateVerdict::malformed;
  return order->kind == SetUpOrderKind::read ? GateVerdict::pass : GateVerdict::not_permitted;
}

/// A poll, exactly as the driver builds it: any other content of its bytes is not sent by this node.
GateVerdict judge_question(const CanFrame& frame, const ModuleQuestion& question, const GateRules& rules) {
  if (frame != rules.modules->ask(question, rules.module_round, rules.module_options)) return GateVerdict::malformed;
  const bool bleeds_as_decided = !question.bleed_above_uV || question.bleed_above_uV == rules.bleed_above_uV;
  return bleeds_as_decided ? GateVerdict::pass : GateVerdict::not_permitted;
}

}  // namespace

GateVerdict judge_output(Port port, const CanFrame& frame, const GateRules& rules) {
  if (port == Port::charger) return judge_charger(frame, rules);
  if (port == Port::inverter) return judge_inverter(frame, rules);
  if (port == Port::internal && rules.modules != nullptr) {
    if (const auto question = rules.modules->question_of(frame)) return judge_question(frame, *question, rules);
  }
  if (port == Port::vehicle && frame.id == rules.reply_id && !frame.is_extended) {
    return frame.length == 8 && !frame.is_remote && !frame.is_error ? GateVerdict::pass : GateVerdict::malformed;
  }
  if (port == Port::vehicle) {
    const MessageSpec* const row = cell_data_row(frame, rules);
    if (row != nullptr) return is_well_formed(*row, frame) ? GateVerdict::pass : GateVerdict::malformed;
  }
  if (port == Port::internal && rules.sensor != nullptr) {
    if (const std::optional<SetUpOrder> order = rules.sensor->order_of(frame)) return judge_sensor(*order, rules);
    const bool is_of_second = rules.second_sensor_command_id != 0 && frame.id == rules.second_sensor_command_id;
    if (is_of_second) return judge_second_sensor(frame, rules);
  }
  const MessageMatch match = find_row(port, frame, rules);
  if (match.message == nullptr || match.message->sender != Sender::bmu) return GateVerdict::not_ours;
  if (!is_well_formed(*match.message, frame)) return GateVerdict::malformed;
  if (match.message == &contactor_command) {
    const ContactorOutputs asked = outputs_of(frame);
    const bool closes_without_permission = asked.any_contactor() && !rules.may_stay_closed;
    if (asked != rules.decided || closes_without_permission) return GateVerdict::not_permitted;
  }
  return GateVerdict::pass;
}

CanFrame contactor_command_frame(const ContactorOutputs& outputs, std::uint8_t counter) {
  CanFrame frame = make_frame(contactor_command);
  write<contactor_command, "main_positive">(frame, outputs.main_positive);
  write<contactor_command, "main_negative">(frame, outputs.main_negative);
  write<contactor_command, "precharge">(frame, outputs.precharge);
  write<contactor_command, "charge">(frame, outputs.charge);
  write<contactor_command, "auxiliary">(frame, outputs.auxiliary);
  write<contactor_command, "fan">(frame, outputs.fan);
  write<contactor_command, "heater">(frame, outputs.heater);
  seal(contactor_command, counter, frame);
  return frame;
}

ContactorOutputs outputs_of(const CanFrame& frame) {
  return {.main_positive = read_raw<contactor_command, "main_positive">(frame) != 0,
          .main_negative = read_raw<contactor_command, "main_negative">(frame) != 0,
          .precharge = read_raw<contactor_command, "precharge">(frame) != 0,
          .charge = read_raw<contactor_command, "charge">(frame) != 0,
          .auxiliary = read_raw<contactor_command, "auxiliary">(frame) != 0,
          .fan = read_raw<contactor_command, "fan">(frame) != 0,
          .heater = read_raw<contactor_command, "heater">(frame) != 0};
}

}  // namespace bmu
