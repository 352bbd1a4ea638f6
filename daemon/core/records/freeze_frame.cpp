#include "daemon/core/records/freeze_frame.hpp"

#include <algorithm>

namespace bmu {

namespace {

std::optional<std::int32_t> known(bool is_known, std::int64_t value) {
  return is_known ? std::optional<std::int32_t>(static_cast<std::int32_t>(value)) : std::nullopt;
}

std::optional<std::int32_t> measured(const Measured<std::int32_t>& value) {
  return known(value.is_valid(), value.value);
}

void freeze_cells(FreezeFrame& frame, const PackState& pack) {
  const Spread& cells = pack.cell_voltage_uV;
  frame.cell_voltage_min_uV = known(cells.is_known(), cells.min);
  frame.cell_voltage_max_uV = known(cells.is_known(), cells.max);
  frame.cell_voltage_average_uV = known(cells.is_known(), cells.average);
  frame.cell_voltage_min_at = cells.min_at;
  frame.cell_voltage_max_at = cells.max_at;
  frame.cell_voltage_sum_mV = measured(pack.cell_voltage_sum_mV);
  frame.module_voltage_sum_mV = measured(pack.module_voltage_sum_mV);
}

void freeze_temperatures(FreezeFrame& frame, const PackState& pack) {
  const Spread& cells = pack.cell_temperature_dC;
  const Spread& boards = pack.board_temperature_dC;
  frame.cell_temperature_min_dC = known(cells.is_known(), cells.min);
  frame.cell_temperature_max_dC = known(cells.is_known(), cells.max);
  frame.cell_temperature_average_dC = known(cells.is_known(), cells.average);
  frame.cell_temperature_min_at = cells.min_at;
  frame.cell_temperature_max_at = cells.max_at;
  frame.board_temperature_min_dC = known(boards.is_known(), boards.min);
  frame.board_temperature_max_dC = known(boards.is_known(), boards.max);
  frame.board_temperature_min_at = boards.min_at;
  frame.board_temperature_max_at = boards.max_at;
}

void freeze_sensors(FreezeFrame& frame, const FreezeSources& from) {
  const AgeConfig& ages = from.config.ages;
  const Measured<std::int32_t>& second = from.sensors.current_2_mA;
  frame.pack_voltage_mV = measured(from.pack.pack_voltage_mV);
  frame.link_voltage_mV = measured(from.pack.link_voltage_mV);
  if (from.link_time_constant) {
    frame.link_time_constant_ms =
        static_cast<std::int32_t>(std::min<std::int64_t>(to_ms(*from.link_time_constant), INT32_MAX));
  }
  frame.current_mA = measured(from.pack.current_mA);
  frame.current_2_mA = known(second.is_usable(from.now, ages.pack_current), second.value);
  if (!from.sensors.pdu.is_usable(from.now, ages.pdu_status)) return;
  const PduState& pdu = from.sensors.pdu.value;
  const SignalValue& insulation = pdu.insulation_resistance_Ohm;
  frame.inputs = pdu;
  frame.insulation_Ohm = known(knows_insulation(pdu) && insulation.is_valid(), insulation.value);
}

}  // namespace

FreezeFrame freeze(const FreezeSources& from) {
  FreezeFrame frame{.unix_time_ms = from.unix_time_ms,
                    .value = from.fault.confirmed.value,
                    .threshold = from.fault.threshold,
                    .element = from.fault.confirmed.element,
                    .phase = from.phase,
                    .mode = from.mode,
                    .soc_permille = from.soc_permille,
                    .discharge_limit_mA = from.limits.discharge.limit_mA,
                    .charge_limit_mA = from.limits.charge.limit_mA,
                    .discharge_overload_permille = known(true, from.overload.discharge_used_permille()),
                    .charge_overload_permille = known(true, from.overload.charge_used_permille()),
                    .outputs = from.outputs};
  freeze_cells(frame, from.pack);
  freeze_temperatures(frame, from.pack);
  freeze_sensors(frame, from);
  return frame;
}

}  // namespace bmu
