#include "daemon/history/history_columns.hpp"

#include <array>

#include "daemon/history/history_schema.hpp"

namespace bmu {

namespace {

template <class Row>
constexpr HistoryColumn<Row> column(std::string_view name, HistoryNumber Row::*member) {
  return {.name = name, .number = member};
}
template <class Row>
constexpr HistoryColumn<Row> column(std::string_view name, std::string Row::*member) {
  return {.name = name, .text = member};
}

constexpr std::array row_table{
    column("life", &HistoryRow::life),
    column("unix_time_ms", &HistoryRow::unix_time_ms),
    column("span_ms", &HistoryRow::span_ms),
    column("uptime_ms", &HistoryRow::uptime_ms),
    column("current_average_mA", &HistoryRow::current_average_mA),
    column("current_min_mA", &HistoryRow::current_min_mA),
    column("current_max_mA", &HistoryRow::current_max_mA),
    column("current_samples", &HistoryRow::current_samples),
    column("pack_voltage_average_mV", &HistoryRow::pack_voltage_average_mV),
    column("pack_voltage_min_mV", &HistoryRow::pack_voltage_min_mV),
    column("pack_voltage_max_mV", &HistoryRow::pack_voltage_max_mV),
    column("pack_voltage_samples", &HistoryRow::pack_voltage_samples),
    column("link_voltage_average_mV", &HistoryRow::link_voltage_average_mV),
    column("link_voltage_min_mV", &HistoryRow::link_voltage_min_mV),
    column("link_voltage_max_mV", &HistoryRow::link_voltage_max_mV),
    column("link_voltage_samples", &HistoryRow::link_voltage_samples),
    column("cell_voltage_min_uV", &HistoryRow::cell_voltage_min_uV),
    column("cell_voltage_average_uV", &HistoryRow::cell_voltage_average_uV),
    column("cell_voltage_max_uV", &HistoryRow::cell_voltage_max_uV),
    column("cells_measured", &HistoryRow::cells_measured),
    column("cell_temperature_min_dC", &HistoryRow::cell_temperature_min_dC),
    column("cell_temperature_average_dC", &HistoryRow::cell_temperature_average_dC),
    column("cell_temperature_max_dC", &HistoryRow::cell_temperature_max_dC),
    column("board_temperature_max_dC", &HistoryRow::board_temperature_max_dC),
    column("soc_permille", &HistoryRow::soc_permille),
    column("soc_sigma_permille", &HistoryRow::soc_sigma_permille),
    column("health_by_capacity_permille", &HistoryRow::health_by_capacity_permille),
    column("health_by_resistance_permille", &HistoryRow::health_by_resistance_permille),
    column("pack_resistance_uOhm", &HistoryRow::pack_resistance_uOhm),
    column("discharge_limit_mA", &HistoryRow::discharge_limit_mA),
    column("charge_limit_mA", &HistoryRow::charge_limit_mA),
    column("discharge_continuous_limit_mA", &HistoryRow::discharge_continuous_limit_mA),
    column("charge_continuous_limit_mA", &HistoryRow::charge_continuous_limit_mA),
    column("discharge_limit_cause", &HistoryRow::discharge_limit_cause),
    column("charge_limit_cause", &HistoryRow::charge_limit_cause),
    column("discharge_continuous_limit_cause", &HistoryRow::discharge_continuous_limit_cause),
    column("charge_continuous_limit_cause", &HistoryRow::charge_continuous_limit_cause),
    column("phase", &HistoryRow::phase),
    column("mode", &HistoryRow::mode),
    column("charge_out_total_uAs", &HistoryRow::charge_out_total_uAs),
    column("charge_in_total_uAs", &HistoryRow::charge_in_total_uAs),
    column("energy_out_total_mWh", &HistoryRow::energy_out_total_mWh),
    column("energy_in_total_mWh", &HistoryRow::energy_in_total_mWh),
    column("charge_out_uAs", &HistoryRow::charge_out_uAs),
    column("charge_in_uAs", &HistoryRow::charge_in_uAs),
    column("energy_out_mWh", &HistoryRow::energy_out_mWh),
    column("energy_in_mWh", &HistoryRow::energy_in_mWh),
    column("uncounted_ms", &HistoryRow::uncounted_ms),
    column("closed_ms", &HistoryRow::closed_ms),
    column("modules_answering_min", &HistoryRow::modules_answering_min),
    column("faults", &HistoryRow::faults),
    column("warnings", &HistoryRow::warnings),
    // Version 2.
    column("energy_left_mWh", &HistoryRow::energy_left_mWh),
    column("energy_left_sigma_mWh", &HistoryRow::energy_left_sigma_mWh),
    column("discharge_power_W", &HistoryRow::discharge_power_W),
    column("charge_power_W", &HistoryRow::charge_power_W),
    column("discharge_continuous_power_W", &HistoryRow::discharge_continuous_power_W),
    column("charge_continuous_power_W", &HistoryRow::charge_continuous_power_W),
    column("discharge_power_cause", &HistoryRow::discharge_power_cause),
    column("charge_power_cause", &HistoryRow::charge_power_cause),
    column("discharge_continuous_power_cause", &HistoryRow::discharge_continuous_power_cause),
    column("charge_continuous_power_cause", &HistoryRow::charge_continuous_power_cause),
};
/// Number of them that the schema has up to each version.
constexpr std::array<std::size_t, 3> columns_up_to{0, 52, row_table.size()};
static_assert(columns_up_to.size() == history_version + 1);
static_assert(row_table[columns_up_to[1] - 1].name == "warnings");

constexpr std::array event_table{
    column("life", &HistoryEvent::life),
    column("number", &HistoryEvent::number),
    column("unix_time_ms", &HistoryEvent::unix_time_ms),
    column("uptime_ms", &HistoryEvent::uptime_ms),
    column("severity", &HistoryEvent::severity),
    column("name", &HistoryEvent::name),
    column("fault", &HistoryEvent::fault),
    column("text", &HistoryEvent::text),
};

constexpr std::array cell_table{
    HistoryCellColumn{"voltage_average_uV",
                      [](const HistoryCell& cell) -> HistoryNumber { return cell.voltage_average_uV; }},
    HistoryCellColumn{"voltage_min_uV", [](const HistoryCell& cell) -> HistoryNumber { return cell.voltage_min_uV; }},
    HistoryCellColumn{"voltage_max_uV", [](const HistoryCell& cell) -> HistoryNumber { return cell.voltage_max_uV; }},
    HistoryCellColumn{"voltage_samples", [](const HistoryCell& cell) -> HistoryNumber { return cell.voltage_samples; }},
    HistoryCellColumn{"soc_permille", [](const HistoryCell& cell) -> HistoryNumber { return cell.soc_permille; }},
    HistoryCellColumn{"health_by_capacity_permille",
                      [](const HistoryCell& cell) -> HistoryNumber { return cell.health_by_capacity_permille; }},
    HistoryCellColumn{"health_by_resistance_permille",
                      [](const HistoryCell& cell) -> HistoryNumber { return cell.health_by_resistance_permille; }},
    HistoryCellColumn{"bled_permille", [](const HistoryCell& cell) -> HistoryNumber { return cell.bled_permille; }},
};

constexpr std::array sensor_table{
    HistorySensorColumn{"temperature_average_dC",
                        [](const HistorySensor& sensor) -> HistoryNumber { return sensor.temperature_average_dC; }},
    HistorySensorColumn{"temperature_min_dC",
                        [](const HistorySensor& sensor) -> HistoryNumber { return sensor.temperature_min_dC; }},
    HistorySensorColumn{"temperature_max_dC",
                        [](const HistorySensor& sensor) -> HistoryNumber { return sensor.temperature_max_dC; }},
    HistorySensorColumn{"temperature_samples",
                        [](const HistorySensor& sensor) -> HistoryNumber { return sensor.temperature_samples; }},
};

}  // namespace

std::span<const HistoryColumn<HistoryRow>> row_columns() {
  return row_table;
}

std::span<const HistoryColumn<HistoryRow>> row_columns_of(std::int64_t version) {
  const auto index = static_cast<std::size_t>(version);
  return std::span(row_table).subspan(columns_up_to.at(index - 1),
                                      columns_up_to.at(index) - columns_up_to.at(index - 1));
}

std::size_t minute_columns(std::int64_t version) {
  constexpr std::size_t others = 4;  // sequence, cells, sensors, checksum
  return columns_up_to.at(static_cast<std::size_t>(version)) + others;
}

std::span<const HistoryColumn<HistoryEvent>> event_columns() {
  return event_table;
}

std::span<const HistoryCellColumn> cell_columns() {
  return cell_table;
}

std::span<const HistorySensorColumn> sensor_columns() {
  return sensor_table;
}

}  // namespace bmu
