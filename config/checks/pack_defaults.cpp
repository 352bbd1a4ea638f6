#include "config/checks/pack_defaults.hpp"

#include <algorithm>
#include <cmath>

#include "config/checks/bus_checks.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/fields/part_reader.hpp"
#include "daemon/core/balancing/balancing_plan.hpp"

namespace bmu {
namespace {

bool is_given(const LimitConfig& limit) {
  return limit.open != never_above.open && limit.open != never_below.open;
}

/// Fault at the cell's absolute minimum, warning halfway from there to the fault of an empty cell.
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

/// Lithium plating occurs below freezing.
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

/// Without a peak current in the file, the pack may carry the warning threshold of overcurrent.
void complete_peak(std::int32_t& peak_mA, std::int32_t continuous_mA, const LimitConfig& overcurrent) {
  if (peak_mA == 0) peak_mA = std::max(overcurrent.warn, continuous_mA);
}

/// A limit falls from its maximum to zero within a quarter of a second, which a motor controller follows without a
/// jerk, and rises within ten seconds: a limit that rises as fast as it falls oscillates.
void complete_ramp(std::int32_t& fall_mA_per_s, std::int32_t& rise_mA_per_s, std::int32_t most_mA) {
  constexpr std::int32_t falls_per_s = 4;
  constexpr std::int32_t rise_s = 10;
  if (fall_mA_per_s == 0) fall_mA_per_s = falls_per_s * most_mA;
  if (rise_mA_per_s == 0) rise_mA_per_s = std::max(most_mA / rise_s, 1);
}

/// A board limit in the pack file also applies in the modules: they do not bleed from its warning on.
void complete_board_limit(CoreConfig& config) {
  const LimitConfig& board = config.limits.board_overtemperature;
  constexpr std::int32_t dC_per_C = 10;
  constexpr std::int32_t most_dC = 1'250;  // maximum that modules accept
  if (board == LimitsConfig{}.board_overtemperature) return;
  config.module_board_limit_dC = std::clamp(board.warn / dC_per_C * dC_per_C, dC_per_C, most_dC);
}

/// Minimum voltage well above an empty cell, top voltage where a full one begins.
void complete_balancing(BalancingConfig& balancing, const CoreConfig& config) {
  constexpr double near_full_permille = 900.0;
  constexpr double full_permille = 1'000.0;
  const std::int32_t low_uV = config.limits.cell_undervoltage.warn;
  const std::int32_t high_uV = config.limits.cell_overvoltage.warn;
  if (balancing.voltage_min_uV == 0) balancing.voltage_min_uV = low_uV + (high_uV - low_uV) / 10;
  if (balancing.top_uV != 0 || config.cell.ocv.size() < 2) return;
  const double halfway_uV = (ocv_uV(config.cell, near_full_permille) + ocv_uV(config.cell, full_permille)) / 2.0;
  balancing.top_uV = std::min(static_cast<std::int32_t>(std::lround(halfway_uV)), high_uV);
}

/// Spread that balancing can reach: a charge that waited for a smaller one would wait without effect.
std::int32_t balance_window_uV(const CoreConfig& config) {
  constexpr std::int32_t least_uV = 10'000;
  const bool goes_by_voltage = config.balancing.method != BalancingMethod::charge;
  return goes_by_voltage ? std::max(left_by_voltage_uV(config), least_uV) : least_uV;
}

/// A cell is full at the end of its curve, and below the warning threshold: a warning in every charge would be ignored.
void complete_charger(CoreConfig& config) {
  constexpr std::int32_t below_uV = 10'000;
  constexpr std::int64_t end_hours = 20;
  constexpr std::int64_t uAs_per_mAh = 3'600'000;
  ChargerConfig& charger = config.charger;
  const LimitConfig& high = config.limits.cell_overvoltage;
  const std::int32_t limited_uV = std::min(high.warn, high.derates_from()) - below_uV;
  const bool has_curve = config.cell.ocv.size() >= 2;  // a cell without it is rejected
  const double full_uV = has_curve ? ocv_uV(config.cell, 1'000.0) : limited_uV;
  if (charger.cell_full_uV == 0) charger.cell_full_uV = std::min(limited_uV, static_cast<std::int32_t>(full_uV));
  // The highest cell controls the charge; this voltage is for a charger that does not follow its commanded current. It
  // leaves a margin for wires.
  constexpr std::int32_t above_permille = 5;
  const std::int32_t above_uV = charger.cell_full_uV / 1'000 * above_permille;
  const std::int64_t cell_uV = std::min(charger.cell_full_uV + above_uV, high.warn);
  const std::int64_t all_uV = cell_uV * static_cast<std::int64_t>(cell_count(config));
  if (charger.voltage_max_mV == 0) charger.voltage_max_mV = mV_from_uV(all_uV);
  if (charger.balance_window_uV == 0) charger.balance_window_uV = balance_window_uV(config);
  if (charger.current_max_mA == 0) charger.current_max_mA = config.current.charge_continuous_mA;
  if (charger.end_current_mA != 0) return;
  const std::int64_t end_mA = config.cell.capacity_uAs / (uAs_per_mAh * end_hours);
  // A charger with a low current ends the charge at a lower one.
  const std::int64_t quarter_mA = charger.current_max_mA / 4;
  charger.end_current_mA = static_cast<std::int32_t>(std::max<std::int64_t>(std::min(end_mA, quarter_mA), 1));
}

/// From the undervoltage warning to a full pack. Uses the full cell of the charger, which is completed before.
void complete_inverter(CoreConfig& config) {
  InverterConfig& inverter = config.inverter;
  const auto cells = static_cast<std::int64_t>(cell_count(config));
  if (inverter.charge_voltage_max_mV == 0) {
    inverter.charge_voltage_max_mV = mV_from_uV(config.charger.cell_full_uV * cells);
  }
  if (inverter.discharge_voltage_min_mV == 0) {
    inverter.discharge_voltage_min_mV = mV_from_uV(config.limits.cell_undervoltage.warn * cells);
  }
}

}  // namespace

void complete_defaults(CoreConfig& config) {
  LimitsConfig& limits = config.limits;
  complete_balancing(config.balancing, config);
  if (!is_given(limits.cell_deep_discharge)) limits.cell_deep_discharge = deep_discharge(config);
  if (!is_given(limits.cell_imbalance)) limits.cell_imbalance = imbalance(limits);
  if (!is_given(limits.charge_overtemperature)) limits.charge_overtemperature = limits.cell_overtemperature;
  if (!is_given(limits.charge_undertemperature)) {
    limits.charge_undertemperature = charge_undertemperature(limits.cell_undertemperature);
  }
  complete_board_limit(config);
  const bool has_pair = config.sensor.has_second_current;
  if (has_pair && !is_given(limits.current_sensors_disagree)) {
    limits.current_sensors_disagree = sensors_disagree(config.current);
  }
  if (config.insulation.monitoring == InsulationMonitoring::measured) limits.insulation_low = insulation_low(config);
  complete_peak(config.current.discharge_peak_mA, config.current.discharge_continuous_mA, limits.discharge_overcurrent);
  complete_peak(config.current.charge_peak_mA, config.current.charge_continuous_mA, limits.charge_overcurrent);
  LimitRampConfig& ramp = config.limit_ramp;
  complete_ramp(ramp.discharge_fall_mA_per_s, ramp.discharge_rise_mA_per_s, config.current.discharge_peak_mA);
  complete_ramp(ramp.charge_fall_mA_per_s, ramp.charge_rise_mA_per_s, config.current.charge_peak_mA);
  complete_bounds(config);
  complete_charger(config);
  complete_inverter(config);
}

void complete_paces(PackConfig& pack) {
  PollConfig& poll = pack.core.poll;
  if (poll.fast_period == 0ns) poll.fast_period = fast_period_left_out(pack);
  if (poll.parked_period == 0ns) poll.parked_period = parked_period_max;
}

}  // namespace bmu
