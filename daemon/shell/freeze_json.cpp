#include "daemon/shell/freeze_json.hpp"

#include <optional>
#include <utility>

#include "daemon/shell/status_json.hpp"
#include "daemon/shell/why_words.hpp"

namespace bmu {

namespace {

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

}  // namespace

Json time_json(std::int64_t unix_time_ms) {
  return unix_time_ms == 0 ? Json(nullptr) : Json(unix_time_ms);
}

Json freeze_json(const FreezeFrame& frame, const FaultRow& row, Json element) {
  Json json{{"unix_time_ms", time_json(frame.unix_time_ms)},
            {key_with_unit("value", row.unit), frame.value},
            {"value_text", value_text(row.unit, frame.value)},
            {key_with_unit("threshold", row.unit), frame.threshold},
            {"threshold_text", row.has_limit() ? Json(value_text(row.unit, frame.threshold)) : Json(nullptr)},
            {"element", std::move(element)},
            {"phase", to_text(frame.phase)},
            {"mode", frame.mode ? Json(to_text(*frame.mode)) : Json(nullptr)}};
  json["cell_voltage_min_uV"] = or_null(frame.cell_voltage_min_uV);
  json["cell_voltage_min_at"] = element_json(frame.cell_voltage_min_at, Unit::uV);
  json["cell_voltage_max_uV"] = or_null(frame.cell_voltage_max_uV);
  json["cell_voltage_max_at"] = element_json(frame.cell_voltage_max_at, Unit::uV);
  json["cell_voltage_average_uV"] = or_null(frame.cell_voltage_average_uV);
  json["cell_voltage_sum_mV"] = or_null(frame.cell_voltage_sum_mV);
  json["module_voltage_sum_mV"] = or_null(frame.module_voltage_sum_mV);
  json["cell_temperature_min_dC"] = or_null(frame.cell_temperature_min_dC);
  json["cell_temperature_min_at"] = element_json(frame.cell_temperature_min_at, Unit::dC);
  json["cell_temperature_max_dC"] = or_null(frame.cell_temperature_max_dC);
  json["cell_temperature_max_at"] = element_json(frame.cell_temperature_max_at, Unit::dC);
  json["cell_temperature_average_dC"] = or_null(frame.cell_temperature_average_dC);
  json["board_temperature_min_dC"] = or_null(frame.board_temperature_min_dC);
  json["board_temperature_min_at"] = element_json(frame.board_temperature_min_at, Unit::dC);
  json["board_temperature_max_dC"] = or_null(frame.board_temperature_max_dC);
  json["board_temperature_max_at"] = element_json(frame.board_temperature_max_at, Unit::dC);
  json["pack_voltage_mV"] = or_null(frame.pack_voltage_mV);
  json["link_voltage_mV"] = or_null(frame.link_voltage_mV);
  json["current_mA"] = or_null(frame.current_mA);
  json["current_2_mA"] = or_null(frame.current_2_mA);
  json["soc_permille"] = or_null(frame.soc_permille);
  json["insulation_Ohm"] = or_null(frame.insulation_Ohm);
  json["discharge_limit_mA"] = frame.discharge_limit_mA;
  json["charge_limit_mA"] = frame.charge_limit_mA;
  json["discharge_overload_permille"] = or_null(frame.discharge_overload_permille);
  json["charge_overload_permille"] = or_null(frame.charge_overload_permille);
  json["outputs"] = frame.outputs ? outputs_json(*frame.outputs) : Json(nullptr);
  json["feedback"] = frame.inputs ? feedback_json(*frame.inputs) : Json(nullptr);
  json["inputs"] = frame.inputs ? inputs_json(*frame.inputs) : Json(nullptr);
  return json;
}

}  // namespace bmu
