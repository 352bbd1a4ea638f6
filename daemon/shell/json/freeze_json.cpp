#include "daemon/shell/json/freeze_json.hpp"

#include "daemon/shell/json/switches_json.hpp"

namespace bmu {

namespace {

/// The reading of the fault's row, its place, and the threshold.
void put_reason(JsonText& to, const FreezeFrame& frame, const FaultRow& row, std::string_view place) {
  to.put(key_with_unit("value", row.unit), frame.value);
  to.put("value_text", value_text(row.unit, frame.value));
  to.put(key_with_unit("threshold", row.unit), frame.threshold);
  to.put("threshold_text", if_known(row.has_limit(), value_text(row.unit, frame.threshold)));
  put_element(to, "element", frame.element, place);
}

void put_cells(JsonText& to, const FreezeFrame& frame) {
  to.put("cell_voltage_min_uV", frame.cell_voltage_min_uV);
  put_element(to, "cell_voltage_min_at", frame.cell_voltage_min_at, Unit::uV);
  to.put("cell_voltage_max_uV", frame.cell_voltage_max_uV);
  put_element(to, "cell_voltage_max_at", frame.cell_voltage_max_at, Unit::uV);
  to.put("cell_voltage_average_uV", frame.cell_voltage_average_uV);
  to.put("cell_voltage_sum_mV", frame.cell_voltage_sum_mV);
  to.put("module_voltage_sum_mV", frame.module_voltage_sum_mV);
  to.put("cell_temperature_min_dC", frame.cell_temperature_min_dC);
  put_element(to, "cell_temperature_min_at", frame.cell_temperature_min_at, Unit::dC);
  to.put("cell_temperature_max_dC", frame.cell_temperature_max_dC);
  put_element(to, "cell_temperature_max_at", frame.cell_temperature_max_at, Unit::dC);
  to.put("cell_temperature_average_dC", frame.cell_temperature_average_dC);
  to.put("board_temperature_min_dC", frame.board_temperature_min_dC);
  put_element(to, "board_temperature_min_at", frame.board_temperature_min_at, Unit::dC);
  to.put("board_temperature_max_dC", frame.board_temperature_max_dC);
  put_element(to, "board_temperature_max_at", frame.board_temperature_max_at, Unit::dC);
}

void put_pack(JsonText& to, const FreezeFrame& frame) {
  to.put("pack_voltage_mV", frame.pack_voltage_mV);
  to.put("link_voltage_mV", frame.link_voltage_mV);
  to.put("link_time_constant_ms", frame.link_time_constant_ms);
  to.put("current_mA", frame.current_mA);
  to.put("current_2_mA", frame.current_2_mA);
  to.put("soc_permille", frame.soc_permille);
  to.put("insulation_Ohm", frame.insulation_Ohm);
  to.put("discharge_limit_mA", frame.discharge_limit_mA);
  to.put("charge_limit_mA", frame.charge_limit_mA);
  to.put("discharge_overload_permille", frame.discharge_overload_permille);
  to.put("charge_overload_permille", frame.charge_overload_permille);
}

void put_switches(JsonText& to, const FreezeFrame& frame) {
  if (frame.outputs) {
    put_outputs(to, *frame.outputs);
  } else {
    to.put("outputs", nullptr);
  }
  if (frame.inputs) {
    put_feedback(to, *frame.inputs);
    put_inputs(to, *frame.inputs);
  } else {
    to.put("feedback", nullptr);
    to.put("inputs", nullptr);
  }
}

}  // namespace

std::optional<std::int64_t> time_or_nothing(std::int64_t unix_time_ms) {
  return if_known(unix_time_ms != 0, unix_time_ms);
}

void put_freeze(JsonText& to, const FreezeFrame& frame, const FaultRow& row, std::string_view place) {
  to.put("unix_time_ms", time_or_nothing(frame.unix_time_ms));
  put_reason(to, frame, row, place);
  to.put("phase", to_text(frame.phase));
  to.put("mode", frame.mode ? std::optional(to_text(*frame.mode)) : std::nullopt);
  put_cells(to, frame);
  put_pack(to, frame);
  put_switches(to, frame);
}

}  // namespace bmu
