// Summary of the pack from its modules and sensors at one instant. Pure; computed again in each tick.
#pragma once

#include <cstdint>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/element.hpp"

namespace bmu {

/// Minimum, maximum and average of the usable values of one kind. `count` values of `expected` were usable.
struct Spread {
  std::int32_t min = 0;
  std::int32_t max = 0;
  std::int32_t average = 0;
  Element min_at;
  Element max_at;
  TimePoint min_taken_at{};
  TimePoint max_taken_at{};
  std::uint16_t count = 0;
  std::uint16_t expected = 0;

  /// Every expected value is usable.
  [[nodiscard]] constexpr bool is_complete() const { return count == expected && expected > 0; }
  [[nodiscard]] constexpr bool is_known() const { return count > 0; }
};

struct PackState {
  TimePoint at{};
  Spread cell_voltage_uV;
  Spread cell_temperature_dC;
  Spread board_temperature_dC;
  // Valid only if complete: a sum with missing values is invalid.
  Measured<std::int32_t> cell_voltage_sum_mV;
  Measured<std::int32_t> module_voltage_sum_mV;
  // Valid only while fresh; copied from the sensors when they are.
  Measured<std::int32_t> pack_voltage_mV;
  Measured<std::int32_t> pack_voltage_before_mV;
  Measured<std::int32_t> link_voltage_mV;
  Measured<std::int32_t> current_mA;
  std::uint16_t modules_answering = 0;  // status, module voltage and all cell voltages are fresh
  std::uint16_t modules_expected = 0;

  /// Every expected module, cell and temperature is usable; boards without sensors expect none.
  [[nodiscard]] constexpr bool is_complete() const {
    return cell_voltage_uV.is_complete() && cell_temperature_dC.is_complete() &&
           board_temperature_dC.count == board_temperature_dC.expected && modules_answering == modules_expected;
  }
  /// All three quantities of the current sensor are valid.
  [[nodiscard]] constexpr bool is_sensed() const {
    return current_mA.is_valid() && pack_voltage_mV.is_valid() && link_voltage_mV.is_valid();
  }
};

/// Summarises the values that are fresh at `now`. Stale, missing and invalid values are omitted, and the counts show
/// it.
[[nodiscard]] PackState summarise(const ModuleTable& modules, const SensorTable& sensors, const CoreConfig& config,
                                  TimePoint now);

/// Number of a board sensor within its module, from its index from 0.
[[nodiscard]] constexpr std::uint8_t board_sensor_number(std::size_t index) {
  return static_cast<std::uint8_t>(cell_sensors_max + index + 1);
}
[[nodiscard]] constexpr bool has_board_sensor(const ModuleRecord& module, std::size_t index) {
  return (module.fitted_boards >> index & 1U) != 0;
}

/// The module counts as answering: status, module voltage and every cell voltage are fresh.
[[nodiscard]] bool is_answering(const ModuleRecord& module, const AgeConfig& ages, TimePoint now);

}  // namespace bmu
