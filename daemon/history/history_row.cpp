#include "daemon/history/history_row.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "daemon/core/vehicle/vehicle_state.hpp"
#include "protocol/units.hpp"

namespace bmu {

namespace {

constexpr std::array<std::string_view, 4> severity_names{"debug", "info", "warning", "error"};

template <class Value>
HistoryNumber number(const std::optional<Value>& value) {
  return value ? HistoryNumber(*value) : std::nullopt;
}
HistoryNumber clock_ms(std::int64_t unix_time_ms) {
  return unix_time_ms == 0 ? std::nullopt : HistoryNumber(unix_time_ms);
}

/// Average, lowest, highest.
struct Three {
  HistoryNumber average;
  HistoryNumber min;
  HistoryNumber max;
};
Three three(const SampledValue& value) {
  if (value.samples == 0) return {};
  return {.average = value.average, .min = value.min, .max = value.max};
}

/// Summary of several values of one kind: the lowest of all, the mean of the means, the highest.
class Summary {
 public:
  void add(const SampledValue& value) {
    if (value.samples == 0) return;
    min_ = count_ == 0 ? value.min : std::min(min_, value.min);
    max_ = count_ == 0 ? value.max : std::max(max_, value.max);
    sum_ += value.average;
    ++count_;
  }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] Three three() const {
    if (count_ == 0) return {};
    return {.average = divide_to_nearest(sum_, count_), .min = min_, .max = max_};
  }

 private:
  std::int32_t min_ = 0;
  std::int32_t max_ = 0;
  std::int64_t sum_ = 0;
  std::int64_t count_ = 0;
};

std::string names_of(const std::bitset<fault_count>& faults) {
  std::string names;
  for (const FaultRow& row : fault_table()) {
    if (!faults.test(static_cast<std::size_t>(row.id))) continue;
    names += (names.empty() ? "" : ",") + std::string(row.name);
  }
  return names;
}

bool is_about_a_fault(EventId id) {
  switch (id) {
    case EventId::fault_warned:
    case EventId::fault_warning_over:
    case EventId::fault_confirmed:
    case EventId::fault_cause_gone:
    case EventId::fault_cleared: return true;
    default: return false;
  }
}

void fill_times(const Minute& minute, HistoryRow& row) {
  row.unix_time_ms = clock_ms(minute.unix_time_ms);
  row.uptime_ms = to_ms(minute.uptime);
  row.span_ms = *row.uptime_ms - to_ms(minute.uptime - minute.span);  // so that rows are contiguous to the millisecond
}

void fill_sensed(const Minute& minute, HistoryRow& row) {
  const Three current_mA = three(minute.current_mA);
  row.current_average_mA = current_mA.average;
  row.current_min_mA = current_mA.min;
  row.current_max_mA = current_mA.max;
  row.current_samples = minute.current_mA.samples;
  const Three pack_mV = three(minute.pack_voltage_mV);
  row.pack_voltage_average_mV = pack_mV.average;
  row.pack_voltage_min_mV = pack_mV.min;
  row.pack_voltage_max_mV = pack_mV.max;
  row.pack_voltage_samples = minute.pack_voltage_mV.samples;
  const Three link_mV = three(minute.link_voltage_mV);
  row.link_voltage_average_mV = link_mV.average;
  row.link_voltage_min_mV = link_mV.min;
  row.link_voltage_max_mV = link_mV.max;
  row.link_voltage_samples = minute.link_voltage_mV.samples;
}

void fill_cells(const Minute& minute, HistoryRow& row) {
  Summary summary;
  row.cells.reserve(minute.cell_count);
  for (std::size_t index = 0; index < minute.cell_count; ++index) {
    const CellMinute& cell = minute.cells[index];
    const Three voltage_uV = three(cell.voltage_uV);
    summary.add(cell.voltage_uV);
    row.cells.push_back({.voltage_average_uV = voltage_uV.average,
                         .voltage_min_uV = voltage_uV.min,
                         .voltage_max_uV = voltage_uV.max,
                         .voltage_samples = cell.voltage_uV.samples,
                         .soc_permille = number(cell.soc_permille),
                         .health_by_capacity_permille = number(cell.health_by_capacity_permille),
                         .health_by_resistance_permille = number(cell.health_by_resistance_permille),
                         .bled_permille = cell.bled_permille});
  }
  const Three voltage_uV = summary.three();
  row.cell_voltage_min_uV = voltage_uV.min;
  row.cell_voltage_average_uV = voltage_uV.average;
  row.cell_voltage_max_uV = voltage_uV.max;
  row.cells_measured = summary.count();
}

void fill_sensors(const Minute& minute, const HistoryLayout& layout, HistoryRow& row) {
  Summary cells;
  Summary boards;
  for (const HistoryPlace& place : layout.sensors()) {
    const SampledValue& value = minute.temperature_dC[row.sensors.size()];
    const Three temperature_dC = three(value);
    (place.is_board ? boards : cells).add(value);
    row.sensors.push_back({.temperature_average_dC = temperature_dC.average,
                           .temperature_min_dC = temperature_dC.min,
                           .temperature_max_dC = temperature_dC.max,
                           .temperature_samples = value.samples});
  }
  const Three temperature_dC = cells.three();
  row.cell_temperature_min_dC = temperature_dC.min;
  row.cell_temperature_average_dC = temperature_dC.average;
  row.cell_temperature_max_dC = temperature_dC.max;
  row.board_temperature_max_dC = boards.three().max;
}

void fill_end(const Minute& minute, HistoryRow& row) {
  row.soc_permille = number(minute.soc_permille);
  row.soc_sigma_permille = number(minute.soc_sigma_permille);
  row.health_by_capacity_permille = number(minute.health_by_capacity_permille);
  row.health_by_resistance_permille = number(minute.health_by_resistance_permille);
  row.pack_resistance_uOhm = minute.pack_resistance_uOhm;
  row.energy_left_mWh = minute.energy_left_mWh;
  row.energy_left_sigma_mWh = minute.energy_left_sigma_mWh;
  row.phase = to_text(minute.phase);
  row.mode = to_text(minute.mode);
  if (!minute.totals) return;
  row.charge_out_total_uAs = minute.totals->charge_out_uAs;
  row.charge_in_total_uAs = minute.totals->charge_in_uAs;
  row.energy_out_total_mWh = minute.totals->energy_out_mWh;
  row.energy_in_total_mWh = minute.totals->energy_in_mWh;
}

void fill_limits(const CurrentLimits& limits, HistoryRow& row) {
  row.discharge_limit_mA = limits.discharge.limit_mA;
  row.charge_limit_mA = limits.charge.limit_mA;
  row.discharge_continuous_limit_mA = limits.discharge_continuous.limit_mA;
  row.charge_continuous_limit_mA = limits.charge_continuous.limit_mA;
  row.discharge_limit_cause = to_text(limits.discharge.cause);
  row.charge_limit_cause = to_text(limits.charge.cause);
  row.discharge_continuous_limit_cause = to_text(limits.discharge_continuous.cause);
  row.charge_continuous_limit_cause = to_text(limits.charge_continuous.cause);
}

void fill_powers(const PowerLimits& powers, HistoryRow& row) {
  row.discharge_power_W = powers.discharge.limit_W;
  row.charge_power_W = powers.charge.limit_W;
  row.discharge_continuous_power_W = powers.discharge_continuous.limit_W;
  row.charge_continuous_power_W = powers.charge_continuous.limit_W;
  row.discharge_power_cause = to_text(powers.discharge.cause);
  row.charge_power_cause = to_text(powers.charge.cause);
  row.discharge_continuous_power_cause = to_text(powers.discharge_continuous.cause);
  row.charge_continuous_power_cause = to_text(powers.charge_continuous.cause);
}

void fill_flow(const Minute& minute, HistoryRow& row) {
  row.charge_out_uAs = minute.charge_out_uAs;
  row.charge_in_uAs = minute.charge_in_uAs;
  row.energy_out_mWh = minute.energy_out_mWh;
  row.energy_in_mWh = minute.energy_in_mWh;
  row.uncounted_ms = to_ms(minute.uncounted);
  row.closed_ms = to_ms(minute.closed);
  row.modules_answering_min = minute.modules_answering_min;
  row.faults = names_of(minute.faults_present);
  row.warnings = names_of(minute.warnings_present);
}

/// Reads the number at the start of the text and removes it, with the character `behind` it unless that is 0.
bool take_number(std::string_view& text, char behind, std::int64_t least, std::int64_t most, std::int64_t& to) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), to);
  if (error != std::errc{} || to < least || to > most) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (behind == 0) return true;
  if (text.empty() || text.front() != behind) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<HistoryModule> take_module(std::string_view& text) {
  HistoryModule module;
  const bool is_one = take_number(text, ':', 1, internal_bus::node_count_max, module.node) &&
                      take_number(text, '+', 0, internal_bus::cells_per_module_max, module.cells) &&
                      take_number(text, '+', 0, internal_bus::cell_temperatures_per_module_max, module.cell_sensors) &&
                      take_number(text, 0, 0, internal_bus::board_temperatures_per_module, module.board_sensors);
  return is_one ? std::optional(module) : std::nullopt;
}

}  // namespace

std::size_t HistoryLayout::cell_count() const {
  std::size_t count = 0;
  for (const HistoryModule& module : modules) count += static_cast<std::size_t>(module.cells);
  return count;
}

std::size_t HistoryLayout::sensor_count() const {
  std::size_t count = 0;
  for (const HistoryModule& module : modules) {
    count += static_cast<std::size_t>(module.cell_sensors + module.board_sensors);
  }
  return count;
}

std::vector<HistoryPlace> HistoryLayout::cells() const {
  std::vector<HistoryPlace> places;
  std::int64_t number = 0;
  for (const HistoryModule& module : modules) {
    for (std::int64_t place = 1; place <= module.cells; ++place) {
      places.push_back({.number = ++number, .module = module.node, .place = place});
    }
  }
  return places;
}

std::vector<HistoryPlace> HistoryLayout::sensors() const {
  std::vector<HistoryPlace> places;
  std::int64_t number = 0;
  for (const HistoryModule& module : modules) {
    for (const bool is_board : {false, true}) {
      const std::int64_t count = is_board ? module.board_sensors : module.cell_sensors;
      for (std::int64_t place = 1; place <= count; ++place) {
        places.push_back({.number = ++number, .module = module.node, .place = place, .is_board = is_board});
      }
    }
  }
  return places;
}

HistoryLayout layout_of(const CoreConfig& config) {
  HistoryLayout layout;
  for (const ModuleConfig& module : config.modules) {
    layout.modules.push_back({.node = module.node,
                              .cells = module.cell_count,
                              .cell_sensors = module.temperature_sensor_count,
                              .board_sensors = internal_bus::board_temperatures_per_module});
  }
  return layout;
}

std::string to_text(const HistoryLayout& layout) {
  std::string text;
  for (const HistoryModule& module : layout.modules) {
    text += (text.empty() ? "" : " ") + std::to_string(module.node) + ":" + std::to_string(module.cells) + "+" +
            std::to_string(module.cell_sensors) + "+" + std::to_string(module.board_sensors);
  }
  return text;
}

std::optional<HistoryLayout> layout_from_text(std::string_view text) {
  HistoryLayout layout;
  while (!text.empty()) {
    const auto module = take_module(text);
    if (!module || layout.modules.size() == modules_max) return std::nullopt;
    layout.modules.push_back(*module);
    if (text.empty()) break;
    if (text.front() != ' ' || text.size() == 1) return std::nullopt;
    text.remove_prefix(1);
  }
  return layout;
}

HistoryRow row_of(const Minute& minute, const HistoryLayout& layout) {
  HistoryRow row;
  fill_times(minute, row);
  fill_sensed(minute, row);
  fill_cells(minute, row);
  fill_sensors(minute, layout, row);
  fill_end(minute, row);
  fill_limits(minute.limits, row);
  fill_powers(minute.powers, row);
  fill_flow(minute, row);
  return row;
}

HistoryEvent event_of(const TimedEvent& timed) {
  const EventRow& row = row_of(timed.event.id);
  return {.number = static_cast<std::int64_t>(timed.number),
          .unix_time_ms = clock_ms(timed.unix_time_ms),
          .uptime_ms = to_ms(timed.uptime),
          .severity = std::string(severity_names.at(static_cast<std::size_t>(severity_of(timed.event)))),
          .name = std::string(row.name),
          .fault = is_about_a_fault(timed.event.id) || timed.event.cause == OpeningCause::fault
                       ? std::string(row_of(timed.event.fault).name)
                       : "",
          .text = to_text(timed.event)};
}

}  // namespace bmu
