#include "daemon/core/output_gate.hpp"

#include "protocol/message.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace bmu {

std::string_view to_text(GateVerdict verdict) {
  switch (verdict) {
    case GateVerdict::pass: return "pass";
    case GateVerdict::not_ours: return "not ours to send";
    case GateVerdict::malformed: return "malformed";
    case GateVerdict::not_permitted: return "not permitted";
  }
  return "?";
}

namespace {

using internal_bus::contactor_command;

MessageMatch find_row(Port port, const CanFrame& frame, std::uint16_t vehicle_base_id) {
  if (port == Port::internal) return internal_bus::catalogue.find(frame.id);
  // The vehicle rows stand at their default identifiers; the configured base moves them.
  return vehicle_bus::catalogue.find(frame.id - vehicle_base_id + vehicle_bus::default_base_id);
}

bool is_well_formed(const MessageSpec& row, const CanFrame& frame) {
  if (frame.is_extended || frame.is_remote || frame.is_error || frame.length != row.length) return false;
  if (has_crc(row) && frame.data[7] != frame_crc(frame)) return false;
  return row.protection != Protection::counter_crc_complement || (frame.data[0] ^ frame.data[1]) == 0xFF;
}

}  // namespace

GateVerdict judge_output(Port port, const CanFrame& frame, const GateRules& rules) {
  const MessageMatch match = find_row(port, frame, rules.vehicle_base_id);
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
