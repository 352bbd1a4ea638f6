#include "config/pack_defaults.hpp"

#include <algorithm>

namespace bmu {
namespace {

bool is_given(const LimitConfig& limit) {
  return limit.open != never_above.open && limit.open != never_below.open;
}

/// Halfway from the fault of an empty cell, which warns of this, to the absolute minimum.
LimitConfig deep_discharge(const CoreConfig& config) {
  const LimitConfig& empty = config.limits.cell_undervoltage;
  const std::int32_t open_uV = config.cell.voltage_min_uV;
  return {.warn = std::max(open_uV + 1'000, open_uV + (empty.open - open_uV) / 2),
          .open = open_uV,
          .hysteresis = empty.hysteresis,
          .confirm = empty.confirm,
          .clear = empty.clear};
}

LimitConfig imbalance(const LimitsConfig& limits) {
  const std::int32_t window_uV = limits.cell_overvoltage.open - limits.cell_undervoltage.open;
  return {.warn = window_uV / 5, .open = window_uV / 2, .hysteresis = window_uV / 20, .confirm = 300ms, .clear = 5s};
}

/// Lithium plates below freezing.
LimitConfig charge_undertemperature(const LimitConfig& cold) {
  if (cold.open >= 0) return cold;
  return {.warn = 50, .limit = 30, .open = 0, .hysteresis = 10, .confirm = cold.confirm, .clear = cold.clear};
}

LimitConfig sensors_disagree(const CurrentLimitConfig& current) {
  const std::int32_t open_mA = 1'000 + current.discharge_continuous_mA / 20;
  return {.warn = open_mA / 2, .open = open_mA, .hysteresis = open_mA / 4, .confirm = 500ms, .clear = 2s};
}

LimitConfig insulation_low(const CoreConfig& config) {
  const std::int64_t full_mV =
      std::int64_t{config.limits.cell_overvoltage.open} * static_cast<std::int64_t>(cell_count(config)) / 1'000;
  const auto of_each_volt = [full_mV](std::int32_t Ohm_per_V) {
    return static_cast<std::int32_t>(full_mV * Ohm_per_V / 1'000);
  };
  const std::int32_t open_Ohm =
      std::max(of_each_volt(config.insulation.open_Ohm_per_V), config.insulation.open_min_Ohm);
  const std::int32_t warn_Ohm = std::max(of_each_volt(config.insulation.warn_Ohm_per_V), open_Ohm + open_Ohm / 10);
  return {.warn = warn_Ohm,
          .open = open_Ohm,
          .hysteresis = open_Ohm / 20,
          .confirm = config.insulation.confirm,
          .clear = 10s};
}

/// Without a peak of its own the pack may carry what the overcurrent limit warns at.
void complete_peak(std::int32_t& peak_mA, std::int32_t continuous_mA, const LimitConfig& overcurrent) {
  if (peak_mA == 0) peak_mA = std::max(overcurrent.warn, continuous_mA);
}

}  // namespace

void complete_defaults(CoreConfig& config) {
  LimitsConfig& limits = config.limits;
  if (!is_given(limits.cell_deep_discharge)) limits.cell_deep_discharge = deep_discharge(config);
  if (!is_given(limits.cell_imbalance)) limits.cell_imbalance = imbalance(limits);
  if (!is_given(limits.charge_overtemperature)) limits.charge_overtemperature = limits.cell_overtemperature;
  if (!is_given(limits.charge_undertemperature)) {
    limits.charge_undertemperature = charge_undertemperature(limits.cell_undertemperature);
  }
  const bool has_pair = config.sensor.has_second_current;
  if (has_pair && !is_given(limits.current_sensors_disagree)) {
    limits.current_sensors_disagree = sensors_disagree(config.current);
  }
  if (config.insulation.monitoring == InsulationMonitoring::measured) limits.insulation_low = insulation_low(config);
  complete_peak(config.current.discharge_peak_mA, config.current.discharge_continuous_mA, limits.discharge_overcurrent);
  complete_peak(config.current.charge_peak_mA, config.current.charge_continuous_mA, limits.charge_overcurrent);
}

}  // namespace bmu
