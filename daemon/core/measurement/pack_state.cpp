#include "daemon/core/measurement/pack_state.hpp"

#include <algorithm>
#include <cstdlib>

namespace bmu {

namespace {

/// Accumulates values; min, max and average are available at any time.
class SpreadBuilder {
 public:
  void expect() { ++spread_.expected; }

  void add(const Measured<std::int32_t>& value, const Element& element) {
    if (spread_.count == 0 || value.value < spread_.min) {
      spread_.min = value.value;
      spread_.min_at = element;
      spread_.min_taken_at = value.taken_at;
    }
    if (spread_.count == 0 || value.value > spread_.max) {
      spread_.max = value.value;
      spread_.max_at = element;
      spread_.max_taken_at = value.taken_at;
    }
    sum_ += value.value;
    oldest_ = std::min(oldest_, value.taken_at);
    ++spread_.count;
  }

  [[nodiscard]] std::int64_t sum() const { return sum_; }
  [[nodiscard]] TimePoint oldest() const { return oldest_; }
  [[nodiscard]] Spread spread() const {
    Spread result = spread_;
    if (result.count > 0) result.average = static_cast<std::int32_t>(divide_to_nearest(sum_, result.count));
    return result;
  }

 private:
  Spread spread_;
  std::int64_t sum_ = 0;
  TimePoint oldest_ = TimePoint::max();
};

struct Builders {
  SpreadBuilder cells;
  SpreadBuilder temperatures;
  SpreadBuilder boards;
  std::uint16_t cells_before = 0;  // in the modules already added
  std::uint16_t sensors_before = 0;
};

void add_module(Builders& builders, const ModuleRecord& module, const AgeConfig& ages, TimePoint now) {
  for (std::uint8_t index = 0; index < module.config.cell_count; ++index) {
    builders.cells.expect();
    const auto number = static_cast<std::uint16_t>(builders.cells_before + index + 1);
    const Element element{module.config.node, static_cast<std::uint8_t>(index + 1), number};
    const Measured<std::int32_t>& voltage = module.cell_voltage_uV[index];
    if (voltage.is_usable(now, ages.cell_voltage)) builders.cells.add(voltage, element);
  }
  for (std::uint8_t index = 0; index < module.config.temperature_sensor_count; ++index) {
    builders.temperatures.expect();
    const auto number = static_cast<std::uint16_t>(builders.sensors_before + index + 1);
    const Element element{module.config.node, static_cast<std::uint8_t>(index + 1), number, true};
    const Measured<std::int32_t>& temperature = module.cell_temperature_dC[index];
    if (temperature.is_usable(now, ages.temperature)) builders.temperatures.add(temperature, element);
  }
  for (std::uint8_t index = 0; index < internal_bus::board_temperatures_per_module; ++index) {
    if (!has_board_sensor(module, index)) continue;
    builders.boards.expect();
    const Measured<std::int32_t>& temperature = module.board_temperature_dC[index];
    const Element element{module.config.node, board_sensor_number(index), 0, true};
    if (temperature.is_usable(now, ages.temperature)) builders.boards.add(temperature, element);
  }
  builders.cells_before = static_cast<std::uint16_t>(builders.cells_before + module.config.cell_count);
  builders.sensors_before =
      static_cast<std::uint16_t>(builders.sensors_before + module.config.temperature_sensor_count);
}

Measured<std::int32_t> only_if_usable(const Measured<std::int32_t>& value, TimePoint now, Duration age_max) {
  return value.is_usable(now, age_max) ? value : Measured<std::int32_t>{};
}

/// Of two sensors the one with the larger magnitude counts, in either direction; a sensor that is lost is a fault of
/// its own. Both values come from only_if_usable: an unusable one is 0, which is never larger.
Measured<std::int32_t> worse_current(const Measured<std::int32_t>& one, const Measured<std::int32_t>& other,
                                     const SensorConfig& config) {
  if (!config.has_second_current) return one;
  if (!one.is_valid()) return other;
  return std::llabs(std::int64_t{other.value}) > std::llabs(std::int64_t{one.value}) ? other : one;
}

/// Sum of the stack voltages measured by the modules; unknown if one is missing.
Measured<std::int32_t> module_sum(const ModuleTable& modules, const AgeConfig& ages, TimePoint now) {
  Measured<std::int32_t> sum{0, now, Validity::valid};
  for (const ModuleRecord& module : modules.modules()) {
    const Measured<std::int32_t>& voltage = module.module_voltage_mV;
    if (!voltage.is_usable(now, ages.cell_voltage)) return {};
    sum.value += voltage.value;
    sum.taken_at = std::min(sum.taken_at, voltage.taken_at);
  }
  return sum;
}

}  // namespace

bool is_answering(const ModuleRecord& module, const AgeConfig& ages, TimePoint now) {
  if (!module.status.is_fresh(now, ages.module_status)) return false;
  if (!module.module_voltage_mV.is_fresh(now, ages.cell_voltage)) return false;
  for (std::uint8_t index = 0; index < module.config.cell_count; ++index) {
    if (!module.cell_voltage_uV[index].is_fresh(now, ages.cell_voltage)) return false;
  }
  return true;
}

PackState summarise(const ModuleTable& modules, const SensorTable& sensors, const CoreConfig& config, TimePoint now) {
  PackState pack{.at = now};
  Builders builders;
  for (const ModuleRecord& module : modules.modules()) {
    add_module(builders, module, config.ages, now);
    ++pack.modules_expected;
    if (is_answering(module, config.ages, now)) ++pack.modules_answering;
  }
  pack.cell_voltage_uV = builders.cells.spread();
  pack.cell_temperature_dC = builders.temperatures.spread();
  pack.board_temperature_dC = builders.boards.spread();
  if (pack.cell_voltage_uV.is_complete()) {
    pack.cell_voltage_sum_mV = {mV_from_uV(builders.cells.sum()), builders.cells.oldest(), Validity::valid};
  }
  pack.module_voltage_sum_mV = module_sum(modules, config.ages, now);
  pack.pack_voltage_mV = only_if_usable(sensors.pack_voltage_mV, now, config.ages.pack_voltage);
  pack.pack_voltage_before_mV = only_if_usable(sensors.pack_voltage_before_mV, now, config.ages.pack_voltage);
  pack.link_voltage_mV = only_if_usable(sensors.link_voltage_mV, now, config.ages.pack_voltage);
  pack.current_mA = worse_current(only_if_usable(sensors.current_mA, now, config.ages.pack_current),
                                  only_if_usable(sensors.current_2_mA, now, config.ages.pack_current), config.sensor);
  return pack;
}

}  // namespace bmu
