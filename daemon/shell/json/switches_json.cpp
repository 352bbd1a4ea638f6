#include "daemon/shell/json/switches_json.hpp"

#include <cstddef>

namespace bmu {

namespace {

struct OutputRow {
  std::string_view name;
  bool ContactorOutputs::*is_on;
};
constexpr OutputRow output_table[] = {
    {"main_positive", &ContactorOutputs::main_positive},
    {"main_negative", &ContactorOutputs::main_negative},
    {"precharge", &ContactorOutputs::precharge},
    {"charge", &ContactorOutputs::charge},
    {"auxiliary", &ContactorOutputs::auxiliary},
    {"fan", &ContactorOutputs::fan},
    {"heater", &ContactorOutputs::heater},
};

struct ContactRow {
  std::string_view name;
  bool PduState::*is_closed;
};
/// In the order of ContactorId, which numbers the bits of LinesConfig::feedback.
constexpr ContactRow contact_table[] = {
    {"main_positive", &PduState::main_positive_closed},
    {"main_negative", &PduState::main_negative_closed},
    {"precharge", &PduState::precharge_closed},
    {"charge", &PduState::charge_closed},
};
static_assert(std::size(contact_table) == contactor_id_count);

struct InputRow {
  std::string_view name;
  bool PduState::*is_on;
  bool LinesConfig::*is_on_line = nullptr;  // null: only the PDU has it
};
constexpr InputRow switch_table[] = {
    {"vehicle_on", &PduState::vehicle_on, &LinesConfig::has_vehicle_on},
    {"charger_connected", &PduState::charger_connected, &LinesConfig::has_charger_connected},
    {"estop_1_released", &PduState::estop_1_released},
    {"estop_2_released", &PduState::estop_2_released},
    {"interlock_closed", &PduState::interlock_closed},
    {"insulation_monitor_ok", &PduState::insulation_monitor_ok, &LinesConfig::has_insulation_ok},
    {"resume_button", &PduState::resume_button, &LinesConfig::has_resume_button},
    {"supply_ok", &PduState::supply_ok, &LinesConfig::has_supply_ok},
};

/// Numbers of the bits that are set, counted from 1.
void put_numbers(JsonText& to, std::string_view name, bool is_known, unsigned bits) {
  if (!is_known) return to.put(name, nullptr);
  to.array(name, [&] {
    for (unsigned number = 1; bits != 0; ++number, bits >>= 1U) {
      if ((bits & 1U) != 0) to.add(number);
    }
  });
}

}  // namespace

void put_outputs(JsonText& to, const ContactorOutputs& outputs) {
  to.object("outputs", [&] {
    for (const OutputRow& row : output_table) to.put(row.name, outputs.*row.is_on);
  });
}

void put_feedback(JsonText& to, const PduState& pdu, const LinesConfig* missing) {
  const unsigned missing_contacts = missing != nullptr ? missing->feedback : 0U;
  to.object("feedback", [&] {
    for (std::size_t i = 0; i < contactor_id_count; ++i) {
      const ContactRow& row = contact_table[i];
      to.put(row.name, if_known(((missing_contacts >> i) & 1U) == 0, pdu.*row.is_closed));
    }
    to.put("opened_by_timeout", pdu.opened_by_timeout);
    to.put("alarm_loop_open", pdu.alarm_loop_open);
  });
}

void put_inputs(JsonText& to, const PduState& pdu, const LinesConfig* missing) {
  const SignalValue& throttle = pdu.throttle_permille;
  const SignalValue& resistance = pdu.insulation_resistance_Ohm;
  to.object("inputs", [&] {
    for (const InputRow& row : switch_table) {
      const bool is_missing = missing != nullptr && row.is_on_line != nullptr && missing->*row.is_on_line;
      to.put(row.name, if_known(!is_missing, pdu.*row.is_on));
    }
    put_numbers(to, "estops_pressed", missing == nullptr, pdu.estops_pressed);
    put_numbers(to, "interlocks_open", missing == nullptr, pdu.interlocks_open);
    to.put("throttle_permille", if_known(throttle.is_valid(), throttle.value));
    to.put("insulation_state", to_text(pdu.insulation_state));
    to.put("insulation_resistance_Ohm", if_known(resistance.is_valid(), resistance.value));
    to.put("insulation_resistance_validity", to_text(resistance.validity));
  });
}

}  // namespace bmu
